//! The monitor's screen.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Gauge, Paragraph, Sparkline};

use super::state::{Monitor, Shown, size};
use super::targets::ShownTargets;

/// Above this the bus has no room for what is not periodic.
const FULL_LOAD: f64 = 0.6;

/// Draws everything; `colour`: the terminal and its user want it.
pub fn draw(frame: &mut Frame<'_>, source: &str, monitor: &Monitor, colour: bool) {
    let shown = monitor.shown();
    let lines = lines(&shown, colour);
    let title = format!(" cathforce · {source} · {:.0} s ", shown.seconds);
    let block = Block::bordered().title(title).title_bottom(" q quits ");
    let inner = block.inner(frame.area());
    frame.render_widget(block, frame.area());
    let advice = wrapped(shown.advice.as_deref().unwrap_or_default(), inner.width);
    let [hint, text, load, caption, history] = Layout::vertical([
        Constraint::Length(advice.len() as u16),
        Constraint::Length(lines.len() as u16),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Fill(1),
    ])
    .areas(inner);
    let style = paint(Color::Yellow, colour);
    frame.render_widget(Paragraph::new(advice).style(style), hint);
    frame.render_widget(Paragraph::new(lines), text);
    let style = paint(if shown.bus_load > FULL_LOAD { Color::Red } else { Color::Green }, colour);
    let label = format!("bus {:.1} % of 1 Mbit/s", 100.0 * shown.bus_load);
    let gauge = Gauge::default().ratio(shown.bus_load.clamp(0.0, 1.0)).label(label);
    frame.render_widget(gauge.gauge_style(style), load);
    let width = usize::from(history.width);
    let mut forces: Vec<_> = monitor.history_mn().rev().take(width).collect();
    forces.reverse();
    let peak = forces.iter().max().copied().unwrap_or(0);
    let seconds = forces.len() as f64 * 0.1;
    let text = format!("force on the vessel, last {seconds:.0} s, peak {peak} mN");
    frame.render_widget(Paragraph::new(text), caption);
    frame.render_widget(Sparkline::default().data(forces), history);
}

fn paint(colour: Color, on: bool) -> Style {
    if on { Style::new().fg(colour) } else { Style::new() }
}

/// Lines of whole words, none longer than `width` unless a word is. A command between backticks
/// stays on one line if it fits on one.
fn wrapped(text: &str, width: u16) -> Vec<Line<'static>> {
    let width = usize::from(width);
    let mut lines: Vec<String> = Vec::new();
    let mut put = |piece: &str| match lines.last_mut() {
        Some(line) if line.chars().count() + 1 + piece.chars().count() <= width => {
            *line += " ";
            *line += piece;
        }
        _ => lines.push(piece.into()),
    };
    let mut command = Vec::new();
    for word in text.split_whitespace() {
        let turns = word.matches('`').count() % 2 == 1;
        if command.is_empty() && !turns {
            put(word);
            continue;
        }
        let ends = turns && !command.is_empty();
        command.push(word);
        if ends {
            let whole = command.join(" ");
            match whole.chars().count() <= width {
                true => put(&whole),
                false => command.iter().for_each(|word| put(word)),
            }
            command.clear();
        }
    }
    command.iter().for_each(|word| put(word));
    lines.into_iter().map(Line::from).collect()
}

fn rates(shown: &Shown) -> String {
    let lock_step = if shown.lock_step { "; lock step, not real time" } else { "" };
    format!("encoder {} Hz, ticks {} Hz{lock_step}", shown.encoder_hz, shown.tick_hz)
}

/// How many targets are reached, and how far away the next one is.
fn reached(own: &ShownTargets) -> String {
    let mut text = format!("{} of {} reached", own.reached_s.len(), own.targets);
    if let Some(last_s) = own.reached_s.last() {
        text += &format!(", the last at {last_s:.1} s");
    }
    if let Some(distance_m) = own.distance_m {
        text += &format!("; the next is {:.1} mm away", 1e3 * distance_m);
    }
    text
}

fn lines(shown: &Shown, colour: bool) -> Vec<Line<'static>> {
    let row = |label: &'static str, value: String, style: Style| {
        Line::from(vec![Span::raw(format!("{label:<12}")), Span::styled(value, style)])
    };
    let plain = Style::new();
    let bold = plain.add_modifier(Modifier::BOLD);
    let alarm = paint(Color::Red, colour).add_modifier(Modifier::BOLD);
    let known = |value: Option<String>| value.unwrap_or_else(|| "–".into());
    let ms = |s: f64| format!("{:.2} ms", 1e3 * s);
    let mn = |n: f32| format!("{:8.1} mN", 1e3 * n);
    let age = shown.end_to_end_s().zip(shown.age_in_device_s);
    let age = age.map(|(whole_s, device_s)| {
        format!("{} end to end, of which in the device {}", ms(whole_s), ms(device_s))
    });
    let drive = shown.insertion_m.zip(shown.rotation_rad).map(|(insertion_m, rotation_rad)| {
        format!("{:.2} mm  {:.1}°", 1e3 * insertion_m, rotation_rad.to_degrees())
    });
    let force = shown.force_n.map(|force_n| {
        let [x, y, z] = force_n.map(mn);
        format!("{}   x {x}  y {y}  z {z}", mn(size(force_n)))
    });
    let band = shown.force_half_width_n.map(|widths_n| {
        let [x, y, z] = widths_n.map(|n| format!("±{:7.1} mN", 1e3 * n));
        let drive = shown.drive_force_half_width_n.map(|n| format!("  drive ±{:.1} mN", 1e3 * n));
        format!("9 of 10 within   x {x}  y {y}  z {z}{}", drive.unwrap_or_default())
    });
    let load = |force_n: Option<f32>, torque_n_m: Option<f32>| {
        let (force_n, torque_n_m) = force_n.zip(torque_n_m)?;
        Some(format!("{}  {:8.1} µN·m", mn(force_n), 1e6 * torque_n_m))
    };
    let limited = if shown.limited { "  limited" } else { "" };
    let fault = if shown.fault.is_some() { alarm } else { plain };
    let mut lines = vec![
        row("state", known(shown.mode.map(str::to_owned)), bold),
        row("fault", shown.fault.unwrap_or("none").to_owned(), fault),
        row("age", known(age), plain),
        row("rates", rates(shown), plain),
        row("ticks", format!("{}, {} unresolved", shown.ticks, shown.unresolved_ticks), plain),
        row("drive", known(drive), plain),
        row("vessel", known(force), bold),
        row("band", band.unwrap_or_else(|| "not known".into()), plain),
        row("drive load", known(load(shown.drive_force_n, shown.drive_torque_n_m)), plain),
    ];
    if let Some(wire) = shown.guidewire {
        let felt = if wire.felt == Some(true) { "  felt" } else { "" };
        let value = known(load(wire.drive_force_n, wire.drive_torque_n_m));
        let at = format!("{:.2} mm  ", 1e3 * wire.insertion_m);
        lines.push(row("guidewire", at + &value + felt, plain));
    }
    let operator = known(load(Some(shown.haptic_force_n), Some(shown.haptic_torque_n_m)));
    lines.push(row("operator", operator + limited, plain));
    if let Some(targets) = &shown.targets {
        lines.push(row("targets", reached(targets), bold));
    }
    let dropouts = shown.dropouts.iter().map(|(cause, frames)| format!("{cause} {frames}"));
    let dropouts = dropouts.collect::<Vec<_>>();
    let (text, style) = match dropouts.is_empty() {
        true => ("none".to_owned(), plain),
        false => (dropouts.join(", "), alarm),
    };
    lines.push(row("dropouts", text, style));
    lines
}
