//! What the sensor says of its unit: `netftapi2.xml` of its web server.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use super::address::SensorAddress;
use super::error::SensorError;
use crate::import::units;

/// The port of the sensor's web server.
pub(super) const HTTP_PORT: u16 = 80;
const PATIENCE: Duration = Duration::from_secs(3);
/// Largest page that is read \[bytes\]; a sensor's has some 4 KiB.
const MOST_BYTES: u64 = 1 << 20;

/// The configuration that is active in the sensor.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Configuration {
    /// One count \[N\].
    pub(super) newtons: f64,
    /// In words.
    pub(super) text: String,
    /// Packets a second that are set.
    pub(super) rate_hz: Option<f64>,
}

impl Configuration {
    /// Counts of the command line.
    pub(super) fn given(counts_per_n: f64) -> Self {
        let text = format!("{counts_per_n} counts are one newton by --counts-per-n");
        Self { newtons: 1.0 / counts_per_n, text, rate_hz: None }
    }

    /// Asks the sensor.
    pub(super) fn ask(address: &SensorAddress, port: u16) -> Result<Self, SensorError> {
        let page = page(address, port).map_err(|why| {
            let problem =
                format!("{address}: its configuration cannot be read from its web server: {why}");
            let fix = "check the address; or say how many counts are one newton: --counts-per-n N";
            SensorError::new(problem, fix)
        })?;
        Self::read(&page).map_err(|problem| {
            let fix = "say how many counts are one newton, from the sensor's page config.htm: --counts-per-n N";
            SensorError::new(format!("{address}: netftapi2.xml {problem}"), fix)
        })
    }

    fn read(page: &str) -> Result<Self, String> {
        let counts = element(page, "cfgcpf").ok_or("has no counts per force (cfgcpf)")?;
        let unit = element(page, "scfgfu").ok_or("has no unit of force (scfgfu)")?;
        let counts_per_unit = counts.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
        let counts_per_unit =
            counts_per_unit.ok_or_else(|| format!("has `{counts}` as its counts per force"))?;
        let newtons = units::newtons(unit).ok_or_else(|| {
            format!("has the unit of force `{unit}`, which is none of {}", units::known())
        })?;
        let rate_hz = element(page, "comrdtrate").and_then(|rate| rate.parse().ok());
        Ok(Self {
            newtons: newtons / counts_per_unit,
            text: format!("{counts_per_unit} counts are one {unit} by its own configuration"),
            rate_hz: rate_hz.filter(|rate: &f64| rate.is_finite() && *rate > 0.0),
        })
    }
}

/// The text of the first element of a name.
fn element<'a>(page: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = page.split_once(&format!("<{name}>"))?;
    rest.split_once(&format!("</{name}>")).map(|(text, _)| text.trim())
}

fn page(address: &SensorAddress, port: u16) -> Result<String, String> {
    let failed = |e: std::io::Error| e.to_string();
    let at = address.at(port).map_err(|e| e.problem)?;
    let mut stream = TcpStream::connect_timeout(&at, PATIENCE).map_err(failed)?;
    stream.set_read_timeout(Some(PATIENCE)).map_err(failed)?;
    let request = format!("GET /netftapi2.xml HTTP/1.0\r\nHost: {}\r\n\r\n", address.host);
    stream.write_all(request.as_bytes()).map_err(failed)?;
    let mut answer = Vec::new();
    stream.take(MOST_BYTES).read_to_end(&mut answer).map_err(failed)?;
    let answer = String::from_utf8_lossy(&answer);
    let first = answer.lines().next().unwrap_or_default();
    match first.split_whitespace().nth(1) {
        Some("200") => Ok(answer.into_owned()),
        _ => Err(format!("it answers `{first}`")),
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    /// A web server that gives one answer.
    fn server(answer: &'static str) -> (SensorAddress, u16) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut request = [0; 1024];
            let read = stream.read(&mut request).unwrap();
            assert!(request[..read].starts_with(b"GET /netftapi2.xml HTTP/1.0\r\n"));
            stream.write_all(answer.as_bytes()).unwrap();
        });
        (SensorAddress::parse("netft:127.0.0.1").unwrap(), port)
    }

    #[test]
    fn the_sensor_says_its_unit_itself() {
        let (address, port) = server(
            "HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n<netft><cfgcpf>1000</cfgcpf>\
             <scfgfu>lbf</scfgfu><comrdtrate>500</comrdtrate></netft>",
        );
        let found = Configuration::ask(&address, port).unwrap();
        assert!((found.newtons - 4.448_221_615_260_5e-3).abs() < 1e-12, "{found:?}");
        assert_eq!((found.rate_hz, &found.text[..10]), (Some(500.0), "1000 count"));
    }

    #[test]
    fn a_page_that_does_not_say_it_has_a_way_out() {
        for (answer, says) in [
            ("HTTP/1.0 404 Not Found\r\n\r\n", "it answers `HTTP/1.0 404 Not Found`"),
            ("HTTP/1.0 200 OK\r\n\r\n<netft></netft>", "has no counts per force"),
            (
                "HTTP/1.0 200 OK\r\n\r\n<cfgcpf>0</cfgcpf><scfgfu>N</scfgfu>",
                "has `0` as its counts per force",
            ),
            ("HTTP/1.0 200 OK\r\n\r\n<cfgcpf>9</cfgcpf><scfgfu>st</scfgfu>", "unit of force `st`"),
        ] {
            let (address, port) = server(answer);
            let error = Configuration::ask(&address, port).unwrap_err();
            assert!(error.problem.contains(says), "{says}: {error}");
            assert!(error.fix.contains("--counts-per-n"), "{error}");
        }
    }
}
