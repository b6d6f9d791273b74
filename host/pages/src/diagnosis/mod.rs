//! One HTML page of a diagnosis: it needs nothing else, not even a script.

pub(crate) mod charts;
mod map;
mod vessel;

use std::fmt::Write as _;

use cathforce_gap::Cell;
use cathforce_gap::report::{Detectable, Diagnosis, Figures, Verdict};
use cathforce_gap::rounding::{percent, quantity};
use cathforce_gap::wording;

use crate::escape::html as escape;

const STYLE: &str = include_str!("page.css");

/// The page: the verdict in a sentence, then where, which, how far, and how to get it again.
pub fn diagnosis_page(answer: &Diagnosis) -> String {
    let mut body = String::new();
    let sentence = answer.sentence();
    let first = sentence.split_inclusive(". ").next().unwrap_or_default();
    let others = &sentence[first.len()..];
    // Writing to a string does not fail.
    let _ = write!(
        body,
        "<p class=soft>{}</p><h1>{}</h1><p>{}</p>{}",
        escape(&format!("Gap diagnosis · {}", answer.bundle)),
        escape(first),
        escape(others),
        tiles(answer)
    );
    let _ = write!(body, "<p class=soft>Compared: {}.</p>", escape(&answer.details.compared));
    let parts = [unnoticed, places, which, left, how_far, band, remarks, again];
    body += &with_contents(&parts.map(|part| part(answer)).concat());
    format!(
        "<!doctype html>\n<html lang=en><meta charset=utf-8>\
         <meta name=viewport content=\"width=device-width,initial-scale=1\">\
         <title>{}</title><style>{STYLE}</style><body>{body}</body></html>\n",
        escape(&format!("Gap of {}", answer.bundle))
    )
}

/// Sections with a list of their headings before them. Text of others is escaped, so that only our own
/// headings begin a section.
fn with_contents(html: &str) -> String {
    const HEADING: &str = "<h2>";
    let sections = html.split(HEADING).skip(1).enumerate();
    let (mut list, mut body) = (String::new(), String::new());
    for (k, section) in sections {
        let title = section.split("</h2>").next().unwrap_or_default();
        // Writing to a string does not fail.
        let _ = write!(list, "<li><a href=\"#part-{k}\">{title}</a>");
        let _ = write!(body, "<section id=\"part-{k}\">{HEADING}{section}</section>");
    }
    format!("<nav aria-label=Contents><ul>{list}</ul></nav>{body}")
}

/// An effect in words, with its identifier for whoever points at it.
fn named(id: &str) -> String {
    hover(id, wording::name(id))
}

fn hover(id: &str, words: &str) -> String {
    format!("<span title=\"{}\">{}</span>", escape(id), escape(words))
}

fn tiles(answer: &Diagnosis) -> String {
    let tile = |value: String, label: &str| {
        format!("<div class=tile><b>{}</b><span>{}</span></div>", escape(&value), escape(label))
    };
    let mut tiles = String::new();
    let (unit, what) = (answer.gap.units.force(), answer.gap.units.of_force());
    if let Some(Figures { before, after, floor }) = answer.gap.force_rms_n {
        tiles += &tile(quantity(before, unit), &format!("{what} RMS before, held out"));
        if !answer.effects.is_empty() {
            tiles += &tile(quantity(after, unit), &format!("{what} RMS after, held out"));
        }
        tiles += &tile(quantity(floor, unit), "noise floor");
    }
    if !answer.effects.is_empty() {
        tiles += &tile(percent(answer.details.shrink), "of the gap above the floor closed");
    }
    format!("<div class=tiles>{tiles}</div>")
}

fn remarks(answer: &Diagnosis) -> String {
    if answer.remarks.is_empty() {
        return String::new();
    }
    let item = |remark: &String| {
        let end = if remark.ends_with('.') { "" } else { "." };
        format!("<li>{}{end}</li>", escape(&wording::capitalised(remark)))
    };
    let items: String = answer.remarks.iter().map(item).collect();
    format!("<h2>What to keep in mind</h2><ul>{items}</ul>")
}

/// Where nothing was found: from which size on each effect would have been seen.
fn unnoticed(answer: &Diagnosis) -> String {
    let found_nothing = matches!(answer.verdict, Verdict::NoGap | Verdict::Inconclusive);
    if !found_nothing || answer.detectable.is_empty() {
        return String::new();
    }
    let row = |own: &Detectable| {
        format!(
            "<tr><td>{}<td>{}<td class=number>{}",
            named(own.id),
            escape(own.parameter),
            escape(&own.seen_from())
        )
    };
    let rows: String = answer.detectable.iter().map(row).collect();
    format!(
        "<h2>What would have gone unnoticed</h2><p>Had an effect been there, these trials would have \
         shown it with 90 % probability from this value on. What is smaller goes unnoticed.</p>\
         <div class=wide><table><tr><th>effect<th>parameter<th class=number>seen from{rows}</table></div>"
    )
}

fn places(answer: &Diagnosis) -> String {
    if answer.places.is_empty() {
        return String::new();
    }
    let details = &answer.details;
    let on_vessel = details.on_vessel.as_ref().map(|of| vessel::figures(of, "the nominal model"));
    format!(
        "<h2>Where</h2>{}{}{}",
        cells(&answer.places, "the gap"),
        on_vessel.unwrap_or_default(),
        map::maps(&details.maps)
    )
}

/// Heat maps and a table. `of`: what the shares are of.
fn cells(places: &[Cell], of: &str) -> String {
    let row = |place: &Cell| {
        format!(
            "<tr><td>{}<td>{}<td>{}<td class=number>{}<td class=number>{}\
             <td class=number>{} ({} to {})<td>{}",
            hover(&place.channel, &wording::channel(&place.channel)),
            escape(&place.phase),
            escape(&place.regime),
            place.stretch(),
            percent(place.time_share),
            percent(place.gap_share),
            percent(place.gap_share_low),
            percent(place.gap_share_high),
            escape(&place.note),
        )
    };
    let rows: String = places.iter().take(12).map(row).collect();
    let by_phase = charts::heat(places, |c| wording::channel(&c.channel), |c| c.phase.clone());
    let mut along = places.to_vec();
    along.sort_by(|a, b| a.arc_m[0].total_cmp(&b.arc_m[0]));
    let by_arc = charts::heat(&along, Cell::stretch, |c| c.phase.clone());
    let drawn = percent(places.iter().map(|cell| cell.gap_share).sum());
    format!(
        "<figure>{by_phase}<figcaption>Share of the energy of {of} by channel and \
         phase, {drawn} in all: what is spread over places of less than 1 % each is not \
         drawn.</figcaption></figure><figure>{by_arc}<figcaption>The same by length inside (or \
         position) and phase.</figcaption></figure><div class=wide><table><tr><th>channel<th>phase\
         <th>regime<th class=number>length<th class=number>of the time<th class=number>of {of} \
         (90 %)<th>the channel in that phase{rows}</table></div>"
    )
}

fn left(answer: &Diagnosis) -> String {
    let Some(left) = &answer.left else { return String::new() };
    let on_vessel = answer.details.left_on_vessel.as_ref();
    let on_vessel = on_vessel.map(|of| vessel::figures(of, "the best model that was found"));
    let would = left.gap.force_rms_n.filter(|_| !left.after.is_empty());
    let would = would.map_or(String::new(), |Figures { before, after, .. }| {
        let [before, after] = [before, after].map(|x| quantity(x, answer.gap.units.force()));
        let what = answer.gap.units.of_force();
        format!("<p>Its {what} is off by {after} RMS, the nominal model's by {before}.</p>")
    });
    format!(
        "<h2>What is left</h2><p>{}.</p>{would}{}{}",
        escape(&wording::capitalised(&left.words)),
        cells(&left.places, "what is left"),
        on_vessel.unwrap_or_default()
    )
}

fn which(answer: &Diagnosis) -> String {
    if answer.ranking.is_empty() {
        return String::new();
    }
    let mut html = String::from("<h2>Which</h2>");
    if !answer.effects.is_empty() {
        html += "<div class=wide><table><tr><th>effect<th>parameter<th class=number>value (90 %)\
                 <th class=number>closes<th class=number>confidence<th>";
        for effect in &answer.effects {
            for (i, (name, p)) in effect.parameters.iter().enumerate() {
                let kind = if effect.material { "material" } else { "minor" };
                let (id, rest) = if i == 0 {
                    let closes = percent(effect.shrink);
                    let confidence = effect.confidence.map_or(String::new(), |c| format!("{c:.2}"));
                    let tail = format!("{closes}<td class=number>{confidence}<td>{kind}");
                    (named(&effect.id), tail)
                } else {
                    (String::new(), "<td><td>".to_owned())
                };
                let [value, low, high] = p.digits();
                let _ = write!(
                    html,
                    "<tr><td>{id}<td>{}<td class=number>{value}{} ({low} to {high})<td class=number>{rest}",
                    escape(name),
                    escape(&p.unit_after()),
                );
            }
        }
        html += "</table></div>";
    }
    for set in &answer.confusable {
        let _ = write!(
            html,
            "<p>Cannot be told apart on this data: {}.</p>",
            set.iter().map(|id| named(id)).collect::<Vec<_>>().join(", ")
        );
    }
    let _ = write!(
        html,
        "<figure>{}<figcaption>Share of the gap that is left after each step.</figcaption></figure>\
         <figure>{}<figcaption>Share of the gap that each effect closes alone, on data that its fit \
         had not seen.</figcaption></figure>",
        charts::waterfall(&answer.details.path),
        charts::ranking(&answer.ranking)
    );
    html
}

fn how_far(answer: &Diagnosis) -> String {
    let mut rows = String::new();
    for (name, Figures { before, after, floor }, unit) in answer.gap.rows() {
        let [before, after, floor] = [before, after, floor].map(|x| quantity(x, unit));
        let _ = write!(
            rows,
            "<tr><td>{name}, all trials<td class=number>{before}<td class=number>{after}\
             <td class=number>{floor}"
        );
    }
    for held_out in &answer.details.held_out {
        let [before, after] =
            [held_out.before_n, held_out.after_n].map(|x| quantity(x, answer.gap.units.force()));
        let _ = write!(
            rows,
            "<tr><td>{} RMS, trial {:03}<td class=number>{before}<td class=number>{after}<td>",
            answer.gap.units.of_force(),
            held_out.trial
        );
    }
    let snaps = answer.gap.snaps.map_or(String::new(), |snaps| {
        format!("<p>{}.</p>", escape(&wording::capitalised(&snaps.sentence())))
    });
    let series: String = answer.series.iter().map(charts::series).collect();
    let with = match answer.left {
        Some(_) => "the best model that was found",
        None => "with the effects",
    };
    format!(
        "<h2>How far</h2><div class=wide><table><tr><th>held out<th class=number>before\
         <th class=number>after<th class=number>floor{rows}</table></div>\
         <p class=soft>{}. Of a vector its norm; of the largest force and of the path the mean over \
         the trials. Paths are compared whatever their pace.</p>{snaps}\
         <p class='soft key'><i style='color:var(--measured)'></i>measured\
         <i style='color:var(--before)'></i>nominal model<i style='color:var(--after)'></i>\
         {with}</p>{series}",
        wording::capitalised(&answer.held_out_trials())
    )
}

/// What each column of the band is of. A drive and a transmission have one quantity, in the first column.
fn banded(answer: &Diagnosis) -> [String; 4] {
    let only = answer.series.iter().map(|series| series.channel.as_str());
    let mut only =
        only.filter(|name| name.starts_with("drive_command_") || name.starts_with("output_"));
    match only.next() {
        Some(name) => [wording::channel(name), String::new(), String::new(), String::new()],
        None => [
            "force on the vessel x",
            "force on the vessel y",
            "force on the vessel z",
            "force behind the guide",
        ]
        .map(str::to_owned),
    }
}

fn band(answer: &Diagnosis) -> String {
    let Some(band) = &answer.band else { return String::new() };
    let mut rows = String::new();
    let names = banded(answer);
    for (name, covered) in names.iter().zip(&band.coverage.channels) {
        if let (Some(share), Some(half_width_n)) = (covered.share(), covered.half_width_n()) {
            let _ = write!(
                rows,
                "<tr><td>{name}<td class=number>±{}<td class=number>{}<td class=number>{}\
                 <td class=number>{}",
                quantity(half_width_n, answer.gap.units.force()),
                percent(share),
                covered.stated,
                covered.unknown
            );
        }
    }
    let charts: String = names
        .iter()
        .enumerate()
        .map(|(column, name)| charts::band(band, column, name, answer.gap.units))
        .collect();
    format!(
        "<h2>How far the forces may be off</h2><p class=soft>Half width of the band in which nine of \
         ten true forces lie with the model that this answer leaves behind.</p>\
         <div class=wide><table><tr><th>force<th class=number>half width, RMS<th class=number>held \
         out and within<th class=number>of samples<th class=number>without a band{rows}</table></div>\
         <p class='soft key'><i style='color:var(--after)'></i>fed\
         <i style='color:var(--before)'></i>withdrawn</p>{charts}"
    )
}

fn again(answer: &Diagnosis) -> String {
    let mut html = String::new();
    if let Some(next) = &answer.next_experiment {
        let _ = write!(
            html,
            "<h2>What to record next</h2><p><b>{}</b>: {}. It separates {}.</p>",
            escape(&next.segment),
            escape(&next.what),
            next.separates.iter().map(|id| named(id)).collect::<Vec<_>>().join(" from ")
        );
    }
    let reproduce = &answer.reproduce;
    let _ = write!(
        html,
        "<h2>The same again</h2><p><code>{}</code></p><p class=soft>version {}, bundle SHA-256 \
         {}; {} simulated trials</p>",
        escape(&reproduce.command),
        escape(&reproduce.version),
        escape(&reproduce.bundle_sha256),
        answer.details.simulations
    );
    html
}

#[cfg(test)]
mod tests {
    use cathforce_gap::diagnose;
    use cathforce_gap::toy::{Toy, effect, noise, parameter};

    use super::*;

    #[test]
    fn figures_of_what_was_measured_are_said_and_no_others() {
        let measured = (0..400).map(|i| 3.0 * i as f64 / 400.0 + 0.01 * noise(i));
        let mut toy =
            Toy::new(0.01, 0.01, measured, |i, p| p.effects[0][0] * i as f64 / 400.0).times(4);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        let answer = diagnose(&toy, "toy", &cathforce_gap::unwatched);
        // The force rises from 0 to 3 N, nominal is none at all.
        let [mae, peak] = [answer.gap.force_mae_n, answer.gap.force_peak_n].map(Option::unwrap);
        assert!((mae.before - 1.5).abs() < 0.01 && (peak.before - 3.0).abs() < 0.03);
        assert!(mae.after < 0.02 && peak.after < 0.05, "{mae:?} {peak:?}");
        let page = diagnosis_page(&answer);
        for row in ["force, mean absolute error, all trials", "largest force of a trial, all"] {
            assert!(page.contains(row), "{row}");
        }
        assert!(!page.contains("path of the tip") && !page.contains("shape RMS"));
        let json = serde_json::to_value(answer.gap).unwrap();
        assert_eq!(json["force_peak_N"]["before"], peak.before);
        assert!(json["force_mae_N"]["floor"].is_f64() && json["tip_frechet_m"].is_null());
        // One map of the force a trial.
        assert_eq!(page.matches("Force error of the nominal model").count(), 4);
    }

    #[test]
    fn every_section_is_in_the_list_of_contents() {
        let page = diagnosis_page(&bounded(10.4));
        let listed = page.matches("<li><a href=\"#part-").count();
        assert_eq!(listed, page.matches("<h2>").count());
        for k in 0..listed {
            assert_eq!(page.matches(&format!("<section id=\"part-{k}\"><h2>")).count(), 1);
        }
        assert!(
            page.contains(">Which</a>") && page.find("<nav").unwrap() < page.find("<h2>").unwrap()
        );
    }

    /// A slope that the effect's bounds let it explain up to 10.
    fn bounded(slope: f64) -> Diagnosis {
        let along = |i: usize| i as f64 / 400.0;
        let measured = (0..400).map(move |i| slope * along(i) + 0.01 * noise(i));
        let mut toy =
            Toy::new(0.01, 0.01, measured, move |i, p| p.effects[0][0] * along(i)).times(4);
        toy.effects = vec![effect("slope", vec![parameter("slope")], vec![vec![1.0]])];
        toy.cheap = false;
        diagnose(&toy, "toy", &cathforce_gap::unwatched)
    }

    #[test]
    fn what_is_left_has_a_section_where_not_all_is_explained() {
        assert!(!diagnosis_page(&bounded(9.5)).contains("<h2>What is left"));
        let beyond = diagnosis_page(&bounded(10.4));
        let said = "<h2>What is left</h2><p>After the model with slope";
        assert!(beyond.contains(said), "{beyond}");
    }
}
