//! The same views as one file: everything that the pages ask of a server lies in it.

use std::fmt::Write as _;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use crate::answers::Shown;
use crate::assets::{ASSETS, Asset};
use crate::error::DashError;
use crate::server::Source;

/// The page and what it loads by its own paths.
const INDEX: &str = "/";
const MAIN: &str = "/main.js";
/// What modules are called in the file, where paths lead nowhere.
const MODULES: &str = "cathforce";
/// What answers are called in the file, before the path that they answer.
const PACKED: &str = "packed";
/// Nothing is loaded from anywhere.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; \
                      img-src data: blob:; media-src blob:";

/// The views of a recording or of a diagnosis as a page that needs no server.
///
/// `fault_pages`: name and text of the page of each fault.
pub fn page(source: &Source, fault_pages: &[(&str, &str)]) -> Result<String, DashError> {
    let shown = match source {
        Source::Recording { name, recording, analysis } => {
            Shown::of_recording(name.clone(), recording, analysis).map_err(DashError::Vessel)?
        }
        Source::Diagnosis { name, answer } => Shown::of_diagnosis(name.clone(), answer),
        Source::Link { .. } | Source::Run { .. } | Source::Diagnosing { .. } => {
            return Err(DashError::NothingToSave);
        }
    };
    let faults = fault_pages.iter().map(|(name, text)| ((*name).to_owned(), json!(text)));
    let mut answers = vec![
        ("/api/source", shown.source().to_string()),
        ("/api/state", shown.state().to_string()),
        ("/api/faults", Value::Object(faults.collect()).to_string()),
    ];
    // A diagnosis has no vessel, and its page asks for none.
    let further = [("/api/data", shown.data()), ("/api/scene", shown.scene())];
    answers
        .extend(further.into_iter().filter_map(|(path, own)| Some((path, own.ok()?.to_string()))));
    let mut packed = String::new();
    for (path, answer) in answers {
        // JSON may hold `<` in its texts alone, and there it has another form that ends no element.
        let answer = answer.replace('<', "\\u003c");
        let _ = writeln!(
            packed,
            "<script type=\"application/json\" id=\"{PACKED}{path}\">{answer}</script>"
        );
    }
    let mut page = text(INDEX).to_owned();
    for asset in ASSETS.iter().filter(|asset| asset.path.ends_with(".css")) {
        let link = format!("<link rel=\"stylesheet\" href=\"{}\">", asset.path);
        page = page.replace(&link, &format!("<style>\n{}</style>", of(asset)));
    }
    let policy =
        format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n</head>");
    let main = format!("<script type=\"module\" src=\"{MAIN}\"></script>");
    let modules = format!(
        "{packed}<script type=\"importmap\">{}</script>\n\
         <script type=\"module\">import \"{MODULES}{MAIN}\";</script>\n{}",
        modules(),
        licences()
    );
    Ok(page.replace("</head>", &policy).replace(&main, &modules))
}

/// Where each module is: in the file itself.
fn modules() -> Value {
    let scripts = ASSETS.iter().filter(|asset| asset.path.ends_with(".js"));
    let module = |asset: &Asset| {
        let bytes = STANDARD.encode(by_name(of(asset)));
        (format!("{MODULES}{}", asset.path), json!(format!("data:text/javascript;base64,{bytes}")))
    };
    json!({ "imports": Value::Object(scripts.map(module).collect()) })
}

/// A module that asks for others by name, not by path.
fn by_name(script: &str) -> String {
    let line = |line: &str| match line.starts_with("import ") {
        true => line
            .replace("from \"./", &format!("from \"{MODULES}/"))
            .replace("from \"/", &format!("from \"{MODULES}/")),
        false => line.to_owned(),
    };
    script.lines().map(|own| line(own) + "\n").collect()
}

/// The licences of what others have written.
fn licences() -> String {
    let licences = ASSETS.iter().filter(|asset| asset.path.ends_with("LICENSE"));
    let element = |asset: &Asset| {
        format!(
            "<script type=\"text/plain\" id=\"{PACKED}{}\">{}</script>\n",
            asset.path,
            of(asset)
        )
    };
    licences.map(element).collect()
}

fn text(path: &str) -> &'static str {
    ASSETS.iter().find(|asset| asset.path == path).map_or("", of)
}

fn of(asset: &Asset) -> &'static str {
    std::str::from_utf8(asset.bytes).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_all_that_it_asks_for_and_no_name_becomes_markup() {
        let answer = json!({ "format": "gap-diagnosis/2", "bundle": "</script><script>alert(1)" });
        let source = Source::Diagnosis { name: "d.json".into(), answer };
        let page = page(&source, &[("EncoderLost", "# EncoderLost")]).unwrap();
        for gone in ["src=\"/", "href=\"/", "</script><script>alert", "from \"./", "from \"/"] {
            assert!(!page.contains(gone), "{gone}");
        }
        let held = |id: &str| page.contains(&format!("id=\"{PACKED}{id}\""));
        assert!(held("/api/source") && held("/api/data") && held("/vendor/uPlot.LICENSE"));
        assert!(!held("/api/scene"), "a diagnosis has no vessel");
        let map = modules();
        for (name, own) in map["imports"].as_object().unwrap() {
            let own = own.as_str().unwrap().split_once("base64,").unwrap().1;
            let script = String::from_utf8(STANDARD.decode(own).unwrap()).unwrap();
            for line in script.lines().filter(|line| line.starts_with("import ")) {
                let from = line.split('"').nth(1).unwrap();
                assert!(map["imports"][from].is_string(), "{name}: {line}");
            }
        }
    }
}
