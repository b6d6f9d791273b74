//! The files of the pages.

/// A file and its type.
pub struct Asset {
    pub path: &'static str,
    pub kind: &'static str,
    pub bytes: &'static [u8],
}

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const TEXT: &str = "text/plain; charset=utf-8";

macro_rules! assets {
    ($($path:literal $kind:ident $file:literal,)+) => {
        /// Everything that a browser may load.
        pub const ASSETS: &[Asset] = &[
            $(Asset { path: $path, kind: $kind, bytes: include_bytes!(concat!("../web/", $file)) },)+
        ];
    };
}

assets! {
    "/" HTML "index.html",
    "/style.css" CSS "style.css",
    "/main.js" SCRIPT "main.js",
    "/format.js" SCRIPT "format.js",
    "/dom.js" SCRIPT "dom.js",
    "/server.js" SCRIPT "server.js",
    "/strip.js" SCRIPT "strip.js",
    "/settings.js" SCRIPT "settings.js",
    "/tracking.js" SCRIPT "tracking.js",
    "/scene.js" SCRIPT "scene.js",
    "/series.js" SCRIPT "series.js",
    "/charts.js" SCRIPT "charts.js",
    "/forces.js" SCRIPT "forces.js",
    "/timing.js" SCRIPT "timing.js",
    "/faults.js" SCRIPT "faults.js",
    "/replay.js" SCRIPT "replay.js",
    "/diagnosis.js" SCRIPT "diagnosis.js",
    "/diagnosing.js" SCRIPT "diagnosing.js",
    "/vendor/uPlot.esm.js" SCRIPT "vendor/uPlot.esm.js",
    "/vendor/uPlot.min.css" CSS "vendor/uPlot.min.css",
    "/vendor/uPlot.LICENSE" TEXT "vendor/uPlot.LICENSE",
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page must not load from elsewhere, and a name from a file must not become markup.
    #[test]
    fn nothing_is_loaded_from_elsewhere_and_no_text_becomes_markup() {
        for asset in ASSETS.iter().filter(|asset| !asset.path.starts_with("/vendor/")) {
            let text = std::str::from_utf8(asset.bytes).unwrap();
            for sink in [
                "http://",
                "https://",
                "innerHTML",
                "outerHTML",
                "insertAdjacentHTML",
                "document.write",
                "eval(",
                "new Function",
                "@import",
                "url(",
            ] {
                // The namespace of SVG is a name, and nothing is loaded from it.
                let text = text.replace("http://www.w3.org/2000/svg", "");
                assert!(!text.contains(sink), "{}: {sink}", asset.path);
            }
        }
        assert!(ASSETS.iter().any(|asset| asset.path.ends_with("LICENSE")));
    }

    /// Every module that a module imports is served.
    #[test]
    fn every_import_is_served() {
        for asset in ASSETS.iter().filter(|asset| asset.path.ends_with(".js")) {
            let text = std::str::from_utf8(asset.bytes).unwrap();
            for line in text.lines().filter(|line| line.starts_with("import ")) {
                let from = line.split('"').nth(1).unwrap().trim_start_matches('.');
                assert!(ASSETS.iter().any(|other| other.path == from), "{}: {line}", asset.path);
            }
        }
    }
}
