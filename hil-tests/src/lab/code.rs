//! The firmware's code: which function calls which, and how much stack each takes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// One function of the image.
#[derive(Clone, Debug, Default)]
pub struct Function {
    /// Demangled, without the hash.
    pub name: String,
    /// Stack that it takes itself \[bytes\].
    pub frame_bytes: u32,
    /// Addresses of the functions that it calls or goes on in.
    pub calls: BTreeSet<u32>,
    /// Calls through a register, whose targets the code does not say.
    pub indirect_calls: usize,
}

/// The functions of an image, by address.
pub struct Code(BTreeMap<u32, Function>);

impl Code {
    /// Disassembles an ELF with the toolchain's own disassembler.
    pub fn of(elf: &Path) -> Self {
        let mut command = Command::new(disassembler());
        command.args(["-d", "--demangle", "--no-show-raw-insn"]).arg(elf);
        let output = command.output().unwrap_or_else(|e| {
            panic!("{command:?}: {e}; `rustup component add llvm-tools` installs it")
        });
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Self::read(&String::from_utf8_lossy(&output.stdout))
    }

    fn read(text: &str) -> Self {
        let mut functions = BTreeMap::new();
        let mut current = None;
        for line in text.lines() {
            if let Some((address, name)) = heading(line) {
                let name = name.rsplit_once("::h").map_or(name, |(name, _)| name).to_owned();
                functions.insert(address, Function { name, ..Function::default() });
                current = Some(address);
            } else if let Some(function) = current.and_then(|at| functions.get_mut(&at)) {
                instruction(line, function);
            }
        }
        let begins: BTreeSet<u32> = functions.keys().copied().collect();
        for (at, function) in &mut functions {
            // Jumps within a function are no calls.
            function.calls.retain(|target| begins.contains(target) && target != at);
        }
        Self(functions)
    }

    /// Address of the only function whose path ends so.
    pub fn find(&self, path: &str) -> u32 {
        let ends = |name: &str| name == path || name.ends_with(&format!("::{path}"));
        let found: Vec<u32> =
            self.0.iter().filter(|(_, f)| ends(&f.name)).map(|(at, _)| *at).collect();
        match found[..] {
            [at] => at,
            ref many => panic!("{} functions are named {path}", many.len()),
        }
    }

    pub fn function(&self, at: u32) -> &Function {
        &self.0[&at]
    }

    pub fn functions(&self) -> impl Iterator<Item = (u32, &Function)> {
        self.0.iter().map(|(at, function)| (*at, function))
    }

    /// Everything that can be reached from `from`, each with whom it was reached through.
    pub fn reachable(&self, from: u32) -> BTreeMap<u32, u32> {
        let mut reached = BTreeMap::from([(from, from)]);
        let mut open = vec![from];
        while let Some(at) = open.pop() {
            for &target in &self.function(at).calls {
                if reached.insert(target, at).is_none() {
                    open.push(target);
                }
            }
        }
        reached
    }

    /// The most stack that a call of `from` takes \[bytes\], and the functions on the way there. Panics on
    /// a recursion, which has no bound.
    pub fn deepest(&self, from: u32) -> (u32, Vec<String>) {
        self.deepest_below(from, &mut Vec::new())
    }

    fn deepest_below(&self, at: u32, above: &mut Vec<u32>) -> (u32, Vec<String>) {
        let function = self.function(at);
        assert!(!above.contains(&at), "{} calls itself", function.name);
        above.push(at);
        let below = function.calls.iter().map(|&target| self.deepest_below(target, above));
        let (bytes, mut way) = below.max_by_key(|(bytes, _)| *bytes).unwrap_or_default();
        above.pop();
        way.insert(0, function.name.clone());
        (function.frame_bytes + bytes, way)
    }
}

/// `00005808 <name>:`
fn heading(line: &str) -> Option<(u32, &str)> {
    let (address, name) = line.strip_suffix(">:")?.split_once(" <")?;
    Some((u32::from_str_radix(address, 16).ok()?, name))
}

/// `5808: bl 0x34588 <name> @ imm = #0xf33a`, with tabs between.
fn instruction(line: &str, function: &mut Function) {
    let Some((address, rest)) = line.trim_start().split_once(':') else { return };
    if u32::from_str_radix(address, 16).is_err() {
        return;
    }
    let mut words = rest.split_whitespace();
    let (Some(operation), operands) = (words.next(), words.collect::<Vec<_>>()) else { return };
    let operation = operation.trim_end_matches(".w").trim_end_matches(".n");
    let registers = || operands.join("").matches(',').count() as u32 + 1;
    match operation {
        "push" => function.frame_bytes += 4 * listed(&operands),
        "vpush" => function.frame_bytes += 8 * listed(&operands),
        "sub" if operands.first() == Some(&"sp,") => {
            // `sub sp, #0x10` or `sub.w sp, sp, #0x10`
            let last = operands.iter().rev().find_map(|word| word.strip_prefix("#0x"));
            let bytes = last.and_then(|hex| u32::from_str_radix(hex, 16).ok());
            function.frame_bytes +=
                bytes.unwrap_or_else(|| panic!("a frame of unknown size: {line}"));
        }
        "stmdb" | "str" if operands.first() == Some(&"sp!,") => {
            function.frame_bytes += 4 * registers();
        }
        "blx" => function.indirect_calls += 1,
        "bx" if operands.first() != Some(&"lr") => function.indirect_calls += 1,
        _ if operation.starts_with('b') || operation.starts_with("cb") => {
            let target = operands.iter().find_map(|word| word.strip_prefix("0x"));
            function.calls.extend(target.and_then(|hex| u32::from_str_radix(hex, 16).ok()));
        }
        _ => {}
    }
}

/// Registers in a list such as `{r4, r5, r7-r9, lr}`.
fn listed(operands: &[&str]) -> u32 {
    let text = operands.join("");
    let list = text.trim_start_matches('{').split('}').next().unwrap_or_default();
    let number = |name: &str| name.trim_start_matches(char::is_alphabetic).parse::<u32>();
    list.split(',')
        .map(|part| match part.split_once('-') {
            Some((first, last)) => match (number(first), number(last)) {
                (Ok(first), Ok(last)) => last - first + 1,
                _ => panic!("registers {part}"),
            },
            None => 1,
        })
        .sum()
}

fn disassembler() -> PathBuf {
    let ask = |what: &[&str]| {
        let output = Command::new("rustc").args(what).output().expect("rustc is installed");
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    };
    let (sysroot, host) = (ask(&["--print", "sysroot"]), ask(&["--print", "host-tuple"]));
    PathBuf::from(sysroot).join("lib/rustlib").join(host).join("bin/llvm-objdump")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "
00000100 <a::main::h0123456789abcdef>:
     100:      \tpush\t{r4, r5, r7, lr}
     102:      \tvpush\t{d8, d9}
     106:      \tsub.w\tsp, sp, #0x28
     10a:      \tbl\t0x200 <a::leaf::h0123456789abcdef> @ imm = #0x0
     10e:      \tbeq\t0x104 <a::main::h0123456789abcdef+0x4> @ imm = #-0x8
     110:      \tblx\tr3
00000200 <a::leaf::h0123456789abcdef>:
     200:      \tsub\tsp, #0x10
     202:      \tbx\tlr
     204:      \tb.w\t0x300 <core::panicking::panic> @ imm = #0x0
00000300 <core::panicking::panic>:
     300:      \tnop
";

    #[test]
    fn calls_frames_and_the_deepest_way_are_read() {
        let code = Code::read(TEXT);
        let main = code.find("a::main");
        let Function { frame_bytes, indirect_calls, .. } = *code.function(main);
        assert_eq!((frame_bytes, indirect_calls), (16 + 16 + 0x28, 1));
        assert_eq!(code.reachable(main).into_keys().collect::<Vec<_>>(), [0x100, 0x200, 0x300]);
        let (bytes, way) = code.deepest(main);
        assert_eq!(bytes, 16 + 16 + 0x28 + 0x10);
        assert_eq!(way[..2], ["a::main", "a::leaf"]);
    }
}
