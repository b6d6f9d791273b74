//! A video, decoded by the programs of FFmpeg.

use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;

use serde::Deserialize;

use super::frame::{Content, Frame};
use crate::error::CameraError;

/// The programs that read a video.
#[derive(Clone, Debug)]
pub struct Ffmpeg {
    pub ffmpeg: PathBuf,
    pub ffprobe: PathBuf,
}

impl Default for Ffmpeg {
    /// Those of the search path.
    fn default() -> Self {
        Self { ffmpeg: "ffmpeg".into(), ffprobe: "ffprobe".into() }
    }
}

/// A video that is being decoded.
pub struct Video {
    path: PathBuf,
    pub size: [usize; 2],
    times_s: Vec<f64>,
    next: usize,
    decoder: Child,
    pixels: ChildStdout,
    /// Reads what the decoder complains of, so that it never waits for a reader.
    complaints: Option<JoinHandle<String>>,
}

/// What ffprobe prints.
#[derive(Deserialize)]
struct Probe {
    #[serde(default)]
    packets: Vec<Packet>,
    #[serde(default)]
    streams: Vec<Stream>,
}

#[derive(Deserialize)]
struct Packet {
    pts_time: Option<String>,
}

#[derive(Deserialize)]
struct Stream {
    width: Option<usize>,
    height: Option<usize>,
}

impl Video {
    /// Opens a video. `rate_hz` replaces its own times.
    pub fn open(programs: &Ffmpeg, path: &Path, rate_hz: Option<f64>) -> Result<Self, CameraError> {
        let (size, mut times_s) = probe(programs, path)?;
        if let Some(rate_hz) = rate_hz {
            times_s = (0..times_s.len()).map(|n| n as f64 / rate_hz).collect();
        }
        // As stored: neither turned nor filled up to an even rate.
        let mut decoder = Command::new(&programs.ffmpeg)
            .args(["-v", "error", "-nostdin", "-noautorotate", "-i"])
            .arg(path)
            .args(["-map", "0:v:0", "-fps_mode", "passthrough"])
            .args(["-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| cannot_start(&programs.ffmpeg, &e))?;
        let (pixels, complaints) = (decoder.stdout.take(), decoder.stderr.take());
        let pixels = pixels.ok_or_else(|| wrong(path, "ffmpeg has no output"))?;
        let complaints = complaints.map(|mut complaints| {
            std::thread::spawn(move || {
                let mut text = Vec::new();
                let _ = complaints.read_to_end(&mut text);
                String::from_utf8_lossy(&text).into_owned()
            })
        });
        Ok(Self { path: path.to_owned(), size, times_s, next: 0, decoder, pixels, complaints })
    }

    /// How many frames there are.
    pub fn count(&self) -> usize {
        self.times_s.len()
    }

    pub(super) fn next_frame(&mut self) -> Result<Option<Frame>, CameraError> {
        let mut bytes = vec![0; self.size[0] * self.size[1]];
        let mut have = 0;
        while have < bytes.len() {
            match self.pixels.read(&mut bytes[have..]) {
                Ok(0) => break,
                Ok(more) => have += more,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(wrong(&self.path, &format!("cannot be decoded: {e}"))),
            }
        }
        if have == 0 {
            return self.end();
        }
        if have < bytes.len() {
            return Err(wrong(&self.path, &format!("breaks off in frame {}", self.next)));
        }
        let Some(t_s) = self.times_s.get(self.next) else {
            let problem = format!("has more frames than times, of which there are {}", self.next);
            return Err(wrong(&self.path, &problem));
        };
        let frame = Frame {
            number: self.next,
            t_s: t_s - self.times_s[0],
            content: Content::Grey { size: self.size, bytes },
        };
        self.next += 1;
        Ok(Some(frame))
    }

    /// After the last frame: all of them were there.
    fn end(&mut self) -> Result<Option<Frame>, CameraError> {
        let said = self.complaints.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let said = said.lines().last().unwrap_or_default().trim();
        let ended = self.decoder.wait();
        if !ended.as_ref().is_ok_and(std::process::ExitStatus::success) {
            return Err(wrong(&self.path, &format!("ffmpeg cannot decode it: {said}")));
        }
        if self.next < self.times_s.len() {
            let (found, all) = (self.next, self.times_s.len());
            let problem = format!("only {found} of its {all} frames can be decoded: {said}");
            return Err(wrong(&self.path, problem.trim_end_matches([':', ' '])));
        }
        Ok(None)
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.decoder.kill();
        let _ = self.decoder.wait();
    }
}

/// Size and times \[s\] of a video's frames, in the order in which they are shown.
fn probe(programs: &Ffmpeg, path: &Path) -> Result<([usize; 2], Vec<f64>), CameraError> {
    let output = Command::new(&programs.ffprobe)
        .args(["-v", "error", "-select_streams", "v:0", "-of", "json"])
        .args(["-show_entries", "stream=width,height:packet=pts_time"])
        .arg(path)
        .stdin(Stdio::null())
        .output()
        .map_err(|e| cannot_start(&programs.ffprobe, &e))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let said = said.lines().last().unwrap_or_default().trim();
        return Err(wrong(path, &format!("ffprobe cannot read it: {said}")));
    }
    let probe: Probe = serde_json::from_slice(&output.stdout)
        .map_err(|e| wrong(path, &format!("ffprobe's answer is not understood: {e}")))?;
    let stream = probe.streams.first();
    let Some((width, height)) = stream.and_then(|stream| stream.width.zip(stream.height)) else {
        return Err(wrong(path, "holds no video"));
    };
    let time = |packet: &Packet| packet.pts_time.as_ref()?.parse::<f64>().ok();
    let times: Option<Vec<f64>> = probe.packets.iter().map(time).collect();
    let Some(mut times_s) = times.filter(|times| !times.is_empty()) else {
        return Err(wrong(path, "does not say when its frames were taken"));
    };
    times_s.sort_by(f64::total_cmp);
    Ok(([width, height], times_s))
}

fn wrong(path: &Path, problem: &str) -> CameraError {
    CameraError::Video(
        format!("{}: {problem}", path.display()),
        format!(
            "record it again; or make pictures of it, `ffmpeg -i {} frames/%05d.png`, and give the folder",
            path.display()
        ),
    )
}

fn cannot_start(program: &Path, error: &std::io::Error) -> CameraError {
    let program = program.display();
    CameraError::Video(
        format!("videos are decoded by the program {program}, which cannot be started: {error}"),
        "install FFmpeg 5.1 or later (`apt install ffmpeg`, `brew install ffmpeg`), or give a folder of \
         PNG or JPEG files"
            .into(),
    )
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// Programs that print what FFmpeg's would.
    fn programs(folder: &Path, probe: &str, decode: &str) -> Ffmpeg {
        let make = |name: &str, script: &str| {
            let path = folder.join(name);
            std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
            std::fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).unwrap();
            path
        };
        Ffmpeg { ffmpeg: make("ffmpeg", decode), ffprobe: make("ffprobe", probe) }
    }

    const PROBE: &str = r#"echo '{"packets":[{"pts_time":"1.5"},{"pts_time":"1.75"},{"pts_time":"1.6"}],
        "streams":[{"width":2,"height":2}]}'"#;

    fn all(programs: &Ffmpeg, rate_hz: Option<f64>) -> Result<Vec<Frame>, CameraError> {
        let mut video = Video::open(programs, Path::new("a.mp4"), rate_hz)?;
        let mut frames = Vec::new();
        while let Some(frame) = video.next_frame()? {
            frames.push(frame);
        }
        Ok(frames)
    }

    #[test]
    fn frames_have_the_times_of_the_video_or_of_a_rate() {
        let folder = tempfile::tempdir().unwrap();
        let programs = programs(folder.path(), PROBE, "printf 'abcdefghijkl'");
        let frames = all(&programs, None).unwrap();
        let times: Vec<f64> = frames.iter().map(|frame| frame.t_s).collect();
        assert!((times[1] - 0.1).abs() < 1e-9 && (times[2] - 0.25).abs() < 1e-9, "{times:?}");
        assert_eq!(frames[1].picture().unwrap().at(0, 0), f32::from(b'e'));
        assert_eq!(all(&programs, Some(10.0)).unwrap()[2].t_s, 0.2);
    }

    #[test]
    fn a_video_that_is_not_whole_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let failed = |probe: &str, decode: &str| {
            let error = all(&programs(folder.path(), probe, decode), None).unwrap_err().to_string();
            assert!(error.contains("a.mp4") && error.contains("fix:"), "{error}");
            error
        };
        assert!(failed(PROBE, "printf 'abcdef'").contains("breaks off in frame 1"));
        let fewer = failed(PROBE, "printf 'abcdefgh'; echo broken >&2");
        assert!(fewer.contains("only 2 of its 3 frames can be decoded: broken"), "{fewer}");
        assert!(failed(PROBE, "echo nonsense >&2; exit 1").contains("cannot decode it: nonsense"));
        assert!(failed("echo gone >&2; exit 1", "").contains("ffprobe cannot read it: gone"));
        assert!(failed("echo '{}'", "").contains("holds no video"));
        assert!(failed(PROBE, "printf 'abcdefghijklmnop'").contains("more frames than times"));
    }

    #[test]
    fn without_the_program_it_is_said_how_to_install_it() {
        let none = Ffmpeg { ffmpeg: "no-such-ffmpeg".into(), ffprobe: "no-such-ffprobe".into() };
        let error = all(&none, None).unwrap_err().to_string();
        assert!(
            error.contains("no-such-ffprobe") && error.contains("apt install ffmpeg"),
            "{error}"
        );
    }
}
