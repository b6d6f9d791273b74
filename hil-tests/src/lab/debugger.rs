//! The remote protocol of gdb, as far as it is used: memory, registers, breakpoints, going on.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// Long for a busy computer.
const PATIENCE: Duration = Duration::from_secs(60);
/// How long an emulator that runs may take to say that it has stopped.
const TO_STOP: Duration = Duration::from_millis(700);

const STACK_POINTER: u32 = 13;
const PROGRAM_COUNTER: u32 = 15;

/// A port that waits for the emulator.
pub struct Listening(TcpListener);

impl Listening {
    pub fn port(&self) -> u16 {
        self.0.local_addr().expect("bound").port()
    }

    pub fn accept(self) -> Debugger {
        let (stream, _) = self.0.accept().expect("the emulator connects");
        stream.set_nodelay(true).expect("TCP");
        Debugger { stream, read: Vec::new(), runs: true }
    }
}

/// A processor under control.
pub struct Debugger {
    stream: TcpStream,
    read: Vec<u8>,
    runs: bool,
}

impl Debugger {
    pub fn listen() -> Listening {
        Listening(TcpListener::bind(("127.0.0.1", 0)).expect("a port"))
    }

    /// Stops the processor, if it runs.
    pub fn stop(&mut self) {
        if !self.runs {
            return;
        }
        self.send(&[3]);
        // One that has been stopped already does not answer.
        let _ = self.packet(TO_STOP);
        self.runs = false;
    }

    /// Lets the processor go on.
    pub fn go_on(&mut self) {
        self.stop();
        self.send_packet("c");
        self.runs = true;
    }

    /// Lets it go on until it is about to execute `at`.
    pub fn run_to(&mut self, at: u32) {
        self.go_on_to(at);
        self.wait_until_at(at);
    }

    /// Lets it go on until it is about to execute `at`, for which [`Debugger::wait_until_at`] waits.
    pub fn go_on_to(&mut self, at: u32) {
        self.stop();
        assert_eq!(self.ask(&format!("Z0,{at:x},2")), "OK");
        self.send_packet("c");
        self.runs = true;
    }

    /// Waits until it is about to execute `at`, to which it goes on.
    pub fn wait_until_at(&mut self, at: u32) {
        let stopped = self.packet(PATIENCE);
        assert!(stopped.is_some(), "the processor does not get to {at:08x}");
        self.runs = false;
        assert_eq!(self.ask(&format!("z0,{at:x},2")), "OK");
        let there = self.register(PROGRAM_COUNTER);
        assert_eq!(there, at, "stopped at {there:08x}, not at {at:08x}");
    }

    /// Lets it go on until it writes to a byte of memory, for which [`Debugger::wait_until_stopped`] waits.
    pub fn go_on_to_write(&mut self, at: u32) {
        self.stop();
        assert_eq!(self.ask(&format!("Z2,{at:x},1")), "OK");
        self.send_packet("c");
        self.runs = true;
    }

    /// Waits until the processor has stopped by itself.
    pub fn wait_until_stopped(&mut self) {
        assert!(self.packet(PATIENCE).is_some(), "the processor does not stop");
        self.runs = false;
    }

    pub fn read(&mut self, at: u32, len: usize) -> Vec<u8> {
        /// Bytes that fit into one answer.
        const PIECE: usize = 1024;
        self.stop();
        let pieces = (0..len).step_by(PIECE).map(|from| {
            let (at, len) = (at + from as u32, PIECE.min(len - from));
            let answer = self.ask(&format!("m{at:x},{len:x}"));
            let bytes = from_hex(&answer).filter(|bytes| bytes.len() == len);
            bytes.unwrap_or_else(|| panic!("memory at {at:08x}: {answer}"))
        });
        pieces.collect::<Vec<_>>().concat()
    }

    pub fn write(&mut self, at: u32, bytes: &[u8]) {
        self.stop();
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(self.ask(&format!("M{at:x},{:x}:{hex}", bytes.len())), "OK", "at {at:08x}");
    }

    pub fn word(&mut self, at: u32) -> u32 {
        let bytes = self.read(at, 4);
        u32::from_le_bytes(bytes.try_into().expect("four"))
    }

    /// Writes a register of a peripheral, which is not memory.
    pub fn set_peripheral(&mut self, at: u32, value: u32) {
        self.stop();
        assert_eq!(self.ask("Qqemu.PhyMemMode:1"), "OK");
        self.write(at, &value.to_le_bytes());
        assert_eq!(self.ask("Qqemu.PhyMemMode:0"), "OK");
    }

    pub fn set_stack_pointer(&mut self, value: u32) {
        self.stop();
        self.set_register(STACK_POINTER, value);
    }

    /// Lets the processor go on elsewhere.
    pub fn set_program_counter(&mut self, at: u32) {
        self.stop();
        self.set_register(PROGRAM_COUNTER, at);
    }

    pub fn stack_pointer(&mut self) -> u32 {
        self.stop();
        self.register(STACK_POINTER)
    }

    fn register(&mut self, number: u32) -> u32 {
        let answer = self.ask(&format!("p{number:x}"));
        let bytes = from_hex(&answer).and_then(|bytes| bytes.try_into().ok());
        u32::from_le_bytes(bytes.unwrap_or_else(|| panic!("register {number}: {answer}")))
    }

    fn set_register(&mut self, number: u32, value: u32) {
        let hex: String = value.to_le_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(self.ask(&format!("P{number:x}={hex}")), "OK");
    }

    /// Asks, and gives the answer.
    fn ask(&mut self, question: &str) -> String {
        self.send_packet(question);
        self.packet(PATIENCE).unwrap_or_else(|| panic!("no answer to {question}"))
    }

    fn send_packet(&mut self, text: &str) {
        let sum = text.bytes().fold(0u8, u8::wrapping_add);
        self.send(format!("${text}#{sum:02x}").as_bytes());
    }

    fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the emulator's debugger listens");
    }

    /// The next packet, acknowledged; `None` after `timeout`.
    fn packet(&mut self, timeout: Duration) -> Option<String> {
        let deadline = Instant::now() + timeout;
        loop {
            if let Some(text) = self.complete() {
                self.send(b"+");
                return Some(text);
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            self.stream.set_read_timeout(Some(left)).expect("TCP");
            let mut buffer = [0; 4096];
            match self.stream.read(&mut buffer) {
                Ok(0) => panic!("the emulator has ended"),
                Ok(n) => self.read.extend(&buffer[..n]),
                Err(_) => {}
            }
        }
    }

    /// Takes a complete packet out of what has been read; acknowledgements before it are dropped.
    fn complete(&mut self) -> Option<String> {
        let begin = self.read.iter().position(|&byte| byte == b'$')?;
        let end = begin + self.read[begin..].iter().position(|&byte| byte == b'#')?;
        if self.read.len() < end + 3 {
            return None;
        }
        let text = String::from_utf8_lossy(&self.read[begin + 1..end]).into_owned();
        self.read.drain(..end + 3);
        Some(text)
    }
}

fn from_hex(text: &str) -> Option<Vec<u8>> {
    let digits = text.as_bytes();
    let pairs = digits.chunks(2).map(|pair| {
        let pair = std::str::from_utf8(pair).ok()?;
        u8::from_str_radix(pair, 16).ok()
    });
    pairs.collect()
}
