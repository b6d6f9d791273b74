//! What the figures look like: `docs/reference/benchmarks.md` and the table of the README.

use std::fmt::Write as _;

use anyhow::Context;
use serde_json::Value;

/// Of a 480 MHz processor in 1 ms.
const CYCLES_A_TICK: f64 = 480e3;

/// A number of the report by its JSON pointer.
fn number(report: &Value, pointer: &str) -> anyhow::Result<f64> {
    let value = report.pointer(pointer).and_then(Value::as_f64);
    value.with_context(|| format!("the report has no number at `{pointer}`"))
}

fn text<'a>(report: &'a Value, pointer: &str) -> anyhow::Result<&'a str> {
    let value = report.pointer(pointer).and_then(Value::as_str);
    value.with_context(|| format!("the report has no text at `{pointer}`"))
}

fn rows<'a>(report: &'a Value, pointer: &str) -> anyhow::Result<&'a Vec<Value>> {
    let value = report.pointer(pointer).and_then(Value::as_array);
    value.with_context(|| format!("the report has no list at `{pointer}`"))
}

/// The page `docs/reference/benchmarks.md`.
pub fn benchmarks(report: &Value) -> anyhow::Result<String> {
    let sections = [
        introduction(report)?,
        device(report)?,
        host(report)?,
        accuracy(report)?,
        insertion(report)?,
    ];
    Ok(sections.join("\n"))
}

fn introduction(report: &Value) -> anyhow::Result<String> {
    Ok(format!(
        "# Benchmarks\n\nWritten by `cargo xtask bench`, all in one run on one machine: {}, {} cores, \
         {}, {}. Times are processor time of one thread, the fastest of three runs for every \
         program. They are no tests: nothing fails when they change.\n",
        text(report, "/machine/processor")?,
        number(report, "/machine/cores")?,
        text(report, "/machine/system")?,
        text(report, "/machine/compiler")?,
    ))
}

fn device(report: &Value) -> anyhow::Result<String> {
    let of = |key: &str| number(report, &format!("/device/{key}"));
    let mut page = String::from(
        "## On the device\n\nThe firmware on the emulated Cortex-M7 playing the deepest trial of the \
         example, 64 links with two samples each; counted exactly, the whole tick with supervision \
         and frames. Cycles are estimated at 1 to 1.3 an instruction.\n\n| | |\n| --- | --- |\n",
    );
    for (name, key) in [
        ("worst tick, one solve", "worst_instructions_one_solve"),
        ("worst tick, two solves", "worst_instructions_two_solves"),
    ] {
        let count = of(key)?;
        let share = |cycles: f64| 100.0 * cycles * count / CYCLES_A_TICK;
        writeln!(
            page,
            "| {name} | {count} instructions, {:.0}–{:.0} % of 480 MHz |",
            share(1.0),
            share(1.3)
        )?;
    }
    writeln!(page, "| jitter with all links in use | ± {:.1} % |", 100.0 * of("jitter")?)?;
    writeln!(page, "| state of the model | {} bytes |", of("state_bytes")?)?;
    writeln!(page, "| stack of a tick | {} bytes |", of("tick_stack_bytes")?)?;
    Ok(page)
}

fn host(report: &Value) -> anyhow::Result<String> {
    let mut page = format!(
        "## On the host\n\nOne core, single precision, one solve a tick of 1 ms; the instrument of \
         the insertion below, wholly inside. With 64 links that is {:.0} × real time.\n\n\
         | links | a tick | growth |\n| --- | --- | --- |\n",
        number(report, "/host/real_time_factor_64_links")?
    );
    let mut before = None;
    for row in rows(report, "/host/scaling")? {
        let us = number(row, "/us_per_tick")?;
        let growth = before.map_or(String::new(), |before| format!("× {:.2}", us / before));
        writeln!(page, "| {} | {us:.1} µs | {growth} |", number(row, "/links")?)?;
        before = Some(us);
    }
    page += "\nContacts, in tubes of different widths, 64 links:\n\n\
             | nodes in contact | a tick |\n| --- | --- |\n";
    for row in rows(report, "/host/contacts")? {
        let (nodes, us) = (number(row, "/nodes_in_contact")?, number(row, "/us_per_tick")?);
        writeln!(page, "| {nodes} | {us:.1} µs |")?;
    }
    page +=
        "\nSize of the stored lumen, 64 links:\n\n| grid | bytes | a tick |\n| --- | --- | --- |\n";
    for row in rows(report, "/host/lumen")? {
        writeln!(
            page,
            "| {} mm | {} | {:.1} µs |",
            number(row, "/cell_mm")?,
            number(row, "/bytes")?,
            number(row, "/us_per_tick")?
        )?;
    }
    Ok(page)
}

fn accuracy(report: &Value) -> anyhow::Result<String> {
    let percent = |key: &str| anyhow::Ok(100.0 * number(report, &format!("/accuracy/{key}"))?);
    Ok(format!(
        "## Accuracy\n\nRMS error of the drive's axial force outside snaps over its peak, against the \
         reference solver, worst of each kind of case (each case: [Validation](validation.md)):\n\n\
         | feeding | reversal | rotation |\n| --- | --- | --- |\n| {:.1} % | {:.1} % | {:.1} % |\n\n\
         Rotation leaves out the cases in which the tip snaps: whips in a bend are off by up to \
         {:.1} %, the jump off a dividing wall by {:.1} %, for after it the tip comes to rest in \
         another of many states. Snaps come early or late by {:.0} ms at most.\n",
        percent("feed")?,
        percent("reversal")?,
        percent("rotation")?,
        percent("whip")?,
        percent("snap")?,
        1e3 * number(report, "/accuracy/snap_s")?,
    ))
}

fn insertion(report: &Value) -> anyhow::Result<String> {
    let of = |key: &str| number(report, &format!("/insertion/{key}"));
    let mut page = format!(
        "## The same insertion in other simulators\n\n\
         A rod of {:.0} mm, {} nodes, radius {:.3} mm, {:.2} g and {:.0} MPa is fed at {:.0} mm/s \
         into a tube that narrows from {:.0} to {:.0} mm in radius, with a bend of {:.0}° and \
         {:.0} mm radius, friction {}, gravity, a wall of {:.1} N/mm², as silicone. The force error is \
         the RMS of the difference in the total force on the wall to the reference solver \
         (`host/reference-solver`, nodes 0.5 mm apart), over the reference's peak as far as the rod is fed; \
         the noise is the RMS of the force about \
         its mean over 0.1 s, over the mean force ({:.1} % for the reference itself, whose force \
         changes too).\n\n\
         | | step | a step | × real time | force error | force noise | Cathforce is faster by |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
        1e3 * of("length_m")?,
        of("nodes")?,
        1e3 * of("radius_m")?,
        1e3 * of("mass_kg")?,
        1e-6 * of("youngs_modulus_pa")?,
        1e3 * of("speed_m_per_s")?,
        1e3 * of("tube/first_radius_m")?,
        1e3 * of("tube/last_radius_m")?,
        of("tube/bend_angle_rad")?.to_degrees(),
        1e3 * of("tube/bend_radius_m")?,
        of("friction_coefficient")?,
        1e-6 * of("wall_stiffness_n_per_m2")?,
        100.0 * number(report, "/reference_noise")?,
    );
    writeln!(
        page,
        "| Cathforce {} | {} ms | {} |",
        env!("CARGO_PKG_VERSION"),
        1e3 * of("sample_s")?,
        figures(report.pointer("/cathforce").context("no own figures")?, None)?
    )?;
    let own = number(report, "/cathforce/real_time_factor")?;
    let peers = rows(report, "/peers")?;
    for peer in peers {
        writeln!(
            page,
            "| {} {} | {} ms | {} |",
            text(peer, "/name")?,
            text(peer, "/version")?,
            1e3 * number(peer, "/step_s")?,
            figures(peer, Some(own))?
        )?;
    }
    page += "\nSet up in good faith, tuned lightly (`host/bench/peers`), steps as long as their \
             results allow:\n\n";
    for peer in peers {
        writeln!(
            page,
            "- {}: {}; fed to {:.0} mm.",
            text(peer, "/name")?,
            text(peer, "/remark")?,
            1e3 * number(peer, "/to_m")?
        )?;
    }
    page += SOFA;
    Ok(page)
}

/// What cannot be measured again here.
const SOFA: &str = "
Quoted and not measured again, since no package installs it: SOFA 26.12.99 with BeamAdapter, built \
from source with -O2, on much the same job (150 mm, 50 nodes, rigid tube of radius 5 to 3 mm, \
13 mm/s, friction 0.3) on another machine of 2 cores: 3.77 ms for a step of 1 ms, 0.27 × real \
time, and 4.5 ms for one of 10 ms, 2.2 × real time. MuJoCo took 0.66 ms a step there.
";

/// Four or five cells: a step, real time, error, noise, how much faster `own` is.
fn figures(row: &Value, own: Option<f64>) -> anyhow::Result<String> {
    let factor = number(row, "/real_time_factor")?;
    let faster = own.map_or(String::new(), |own| format!("{:.0} ×", own / factor));
    Ok(format!(
        "{:.1} µs | {} | {:.1} % | {:.1} % | {faster}",
        number(row, "/us_per_step")?,
        if factor < 10.0 { format!("{factor:.2}") } else { format!("{factor:.0}") },
        100.0 * number(row, "/force_error")?,
        100.0 * number(row, "/force_noise")?,
    ))
}

/// The README's table.
pub fn summary(report: &Value) -> anyhow::Result<String> {
    let mut table = String::from(
        "| the same insertion in | × real time | force error |\n| --- | --- | --- |\n",
    );
    let own = report.pointer("/cathforce").context("no own figures")?;
    let mut row = |name: String, of: &Value| -> anyhow::Result<()> {
        let factor = number(of, "/real_time_factor")?;
        let factor = if factor < 10.0 { format!("{factor:.2}") } else { format!("{factor:.0}") };
        writeln!(table, "| {name} | {factor} | {:.1} % |", 100.0 * number(of, "/force_error")?)?;
        Ok(())
    };
    row("Cathforce".into(), own)?;
    for peer in rows(report, "/peers")? {
        row(format!("{} {}", text(peer, "/name")?, text(peer, "/version")?), peer)?;
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn report() -> Value {
        let score = |us: f64, factor: f64| {
            json!({ "us_per_step": us, "real_time_factor": factor, "force_error": 0.01,
                    "force_noise": 0.002 })
        };
        let mut peer = score(50.0, 0.1);
        for (key, value) in [
            ("name", json!("Rod")),
            ("version", json!("1.2.3")),
            ("remark", json!("explicit")),
            ("step_s", json!(5e-6)),
            ("to_m", json!(0.1)),
        ] {
            peer[key] = value;
        }
        json!({
            "machine": { "processor": "Abacus", "cores": 2, "system": "linux", "compiler": "rustc" },
            "host": {
                "real_time_factor_64_links": 125.0,
                "scaling": [{ "links": 16, "us_per_tick": 2.0 }, { "links": 32, "us_per_tick": 4.1 }],
                "contacts": [{ "nodes_in_contact": 3, "us_per_tick": 8.0 }],
                "lumen": [{ "cell_mm": 1.0, "bytes": 1000, "us_per_tick": 8.0 }],
            },
            "device": {
                "worst_instructions_one_solve": 150_000, "worst_instructions_two_solves": 220_000,
                "jitter": 0.02, "state_bytes": 40_000, "tick_stack_bytes": 4_000,
            },
            "accuracy": { "feed": 0.011, "reversal": 0.022, "rotation": 0.033, "whip": 0.044,
                          "snap": 0.155, "snap_s": 0.042 },
            "insertion": {
                "length_m": 0.15, "nodes": 50, "radius_m": 1e-3, "mass_kg": 1e-3,
                "youngs_modulus_pa": 5e7, "speed_m_per_s": 0.01, "friction_coefficient": 0.3,
                "wall_stiffness_n_per_m2": 8e5,
                "sample_s": 1e-3,
                "tube": { "first_radius_m": 5e-3, "last_radius_m": 3e-3, "bend_angle_rad": 1.0,
                          "bend_radius_m": 0.04 },
            },
            "reference_noise": 0.002,
            "cathforce": score(8.0, 125.0),
            "peers": [peer],
        })
    }

    #[test]
    fn every_figure_finds_its_place() {
        let page = benchmarks(&report()).unwrap();
        for expected in [
            "Abacus, 2 cores",
            "| worst tick, one solve | 150000 instructions, 31–41 % of 480 MHz |",
            "| jitter with all links in use | ± 2.0 % |",
            "| 1.1 % | 2.2 % | 3.3 % |",
            "off by up to 4.4 %, the jump off a dividing wall by 15.5 %,",
            "late by 42 ms at most",
            "| 32 | 4.1 µs | × 2.05 |",
            "| Rod 1.2.3 | 0.005 ms | 50.0 µs | 0.10 | 1.0 % | 0.2 % | 1250 × |",
            "- Rod: explicit; fed to 100 mm.",
        ] {
            assert!(page.contains(expected), "`{expected}` is not in:\n{page}");
        }
        assert!(summary(&report()).unwrap().contains("| Rod 1.2.3 | 0.10 | 1.0 % |"));
    }

    #[test]
    fn a_figure_that_is_missing_is_named() {
        let mut report = report();
        report["cathforce"]["force_error"] = Value::Null;
        let error = benchmarks(&report).unwrap_err().to_string();
        assert_eq!(error, "the report has no number at `/force_error`");
    }
}
