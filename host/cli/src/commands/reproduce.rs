//! `cathforce reproduce`: the published systems, computed again beside their printed figures.

use std::sync::Mutex;
use std::sync::atomic::Ordering;

use cathforce_pages::reproduced_page;
use cathforce_reproduce::{Report, markdown, reproduce, table, work};

use crate::args::ReproduceArguments;
use crate::failure::{Code, Failure};
use crate::output::{Kind, check_again, check_apart, write_again};
use crate::session::interrupt_flag;
use crate::ui::Ui;

pub fn run(ui: &Ui, arguments: &ReproduceArguments) -> Result<(), Failure> {
    let systems = arguments.chosen().map_err(|message| Failure::new(Code::Usage, message))?;
    // Said now: the work takes minutes.
    let (json, html, page) = (&arguments.json_file, &arguments.html, &arguments.page);
    let files = [json.out.as_deref(), html.as_deref(), page.as_deref()];
    check_apart(files.into_iter().flatten())?;
    json.check()?;
    html.as_deref().map_or(Ok(()), |file| check_again(file, Kind::Page))?;
    page.as_deref().map_or(Ok(()), |file| check_again(file, Kind::Reproduced))?;
    let interrupted = interrupt_flag()?;
    let progress = Mutex::new(ui.progress("computing", work(&systems), "ms of model"));
    let tell = |done, _| {
        if let Ok(mut progress) = progress.lock() {
            progress.set(done);
        }
    };
    let report = reproduce(&systems, &tell, &|| interrupted.load(Ordering::Relaxed));
    drop(progress);
    let written = json.write(ui, &report, table(&report));
    if let Some(file) = html {
        write_again(file, Kind::Page, reproduced_page(&report))?;
        ui.say(format_args!("page: {}", file.display()));
    }
    if let Some(file) = page {
        write_again(file, Kind::Reproduced, markdown(&report))?;
        ui.say(format_args!("page: {}", file.display()));
    }
    written?;
    check(&report)
}

/// An incomplete table is a failure, although what is there is kept.
fn check(report: &Report) -> Result<(), Failure> {
    let failed: Vec<String> = report.failed().collect();
    if report.interrupted {
        let message = "interrupted: what was finished is printed and written";
        return Err(Failure::new(Code::Failed, message));
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(Failure::new(Code::Failed, format!("not computed: {}", failed.join("; ")))),
    }
}
