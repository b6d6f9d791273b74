//! The `cathforce` program that the suite builds, and its `dash`.
#![allow(dead_code, reason = "every test file uses its own part")]

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

/// The program that the suite builds for all tests, or that `CATHFORCE_PROGRAM` names. It is no dependency of this
/// library, so cargo does not name it here.
pub fn program() -> PathBuf {
    if let Some(named) = std::env::var_os("CATHFORCE_PROGRAM") {
        return named.into();
    }
    let test = std::env::current_exe().unwrap();
    let path = test.parent().and_then(Path::parent).unwrap().join("cathforce");
    let is_there = path.is_file();
    assert!(
        is_there,
        "{}: build it with `cargo build --workspace --bin cathforce`",
        path.display()
    );
    path
}

pub fn command() -> Command {
    let mut command = Command::new(program());
    command.env("NO_COLOR", "1");
    command
}

pub fn cathforce<const N: usize>(arguments: [&str; N]) -> Output {
    command().args(arguments).output().unwrap()
}

pub fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/tapered-none")
}

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A `cathforce dash` that runs.
pub struct Dash {
    process: Child,
    pub address: String,
    pub token_file: Option<PathBuf>,
    /// Where Foxglove is served.
    pub foxglove: Option<String>,
}

impl Dash {
    pub fn start(arguments: &[&str]) -> Self {
        let mut process = command()
            .args(["dash", "--json", "--quiet", "--listen", "127.0.0.1:0"])
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        // It goes on after this answer, so no end of the text is awaited.
        let out = BufReader::new(process.stdout.take().unwrap());
        let said = serde_json::Deserializer::from_reader(out).into_iter::<Value>().next();
        let Some(Ok(said)) = said else {
            process.kill().unwrap();
            panic!("it said {said:?}");
        };
        let address = said["address"].as_str().unwrap().to_owned();
        let token_file = said["token_file"].as_str().map(PathBuf::from);
        let foxglove = said["foxglove"].as_str().map(str::to_owned);
        Self { process, address, token_file, foxglove }
    }

    /// A diagnosis that is shown while it runs.
    pub fn diagnosing(arguments: &[&str]) -> Self {
        let mut process = command()
            .args(["gap", "diagnose", "--dash=127.0.0.1:0"])
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(process.stderr.take().unwrap()).lines().map_while(Result::ok);
        let address = said.find_map(|line| Some(line.split_once("diagnosis at ")?.1.to_owned()));
        // What else it says is read, so that it never waits.
        std::thread::spawn(move || said.for_each(drop));
        let Some(address) = address else {
            process.kill().unwrap();
            panic!("it said no address");
        };
        Self { process, address, token_file: None, foxglove: None }
    }

    /// Number of its process.
    pub fn id(&self) -> u32 {
        self.process.id()
    }

    pub fn token(&self) -> String {
        fs::read_to_string(self.token_file.as_ref().unwrap()).unwrap().trim().to_owned()
    }

    /// What `GET` of a path answers, asked without a browser.
    pub fn get(&self, path: &str) -> Value {
        let host = self.address.trim_start_matches("http://").trim_end_matches('/');
        let mut stream = TcpStream::connect(host).unwrap();
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap()
    }

    /// Asks for a change with the token; gives the answer and its status.
    pub fn change(&self, what: &str) -> (u16, Value) {
        let host = self.address.trim_start_matches("http://").trim_end_matches('/');
        let body = serde_json::json!({ "do": what }).to_string();
        let mut stream = TcpStream::connect(host).unwrap();
        write!(
            stream,
            "POST /api/do HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nAuthorization: Bearer {}\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            self.token(),
            body.len()
        )
        .unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let status = answer.split(' ').nth(1).unwrap().parse().unwrap();
        (status, serde_json::from_str(answer.split_once("\r\n\r\n").unwrap().1).unwrap())
    }

    /// Ends it as a terminal does.
    pub fn end(mut self) {
        let id = self.process.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        assert!(self.process.wait().unwrap().success());
        assert!(self.token_file.take().is_none_or(|path| !path.exists()));
    }
}

impl Drop for Dash {
    fn drop(&mut self) {
        // One that has ended already is ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
