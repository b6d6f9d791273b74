//! Pictures in a folder, in the order of their numbers.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::frame::{Content, Frame};
use crate::decode;
use crate::error::CameraError;

/// Endings of the files that are read.
const ENDINGS: [&str; 3] = ["png", "jpg", "jpeg"];

/// The PNG and JPEG files of a folder, by the number at the end of their names, then by name.
pub fn picture_files(folder: &Path) -> Result<Vec<PathBuf>, CameraError> {
    let wrong = |problem: String, fix: &str| CameraError::File {
        path: folder.to_owned(),
        problem,
        fix: fix.into(),
    };
    let cannot = |e: std::io::Error| wrong(format!("cannot be read: {e}"), "check the folder");
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(cannot)? {
        let path = entry.map_err(cannot)?.path();
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if ending.is_some_and(|ending| ENDINGS.contains(&&ending[..])) {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(wrong("holds no PNG or JPEG file".into(), "give the folder of the pictures"));
    }
    files.sort_by_cached_key(|path| (number(path), path.clone()));
    Ok(files)
}

/// The number at the end of a file's name, before its ending.
fn number(path: &Path) -> Option<usize> {
    let stem = path.file_stem()?.to_string_lossy().into_owned();
    let digits = stem.len() - stem.bytes().rev().take_while(u8::is_ascii_digit).count();
    stem[digits..].parse().ok()
}

/// The frames of a folder.
#[derive(Clone, Debug)]
pub struct Folder {
    files: Vec<(usize, PathBuf)>,
    rate_hz: f64,
    pub size: [usize; 2],
    /// Numbers that are missing between the first and the last.
    pub missing: Vec<usize>,
    next: usize,
}

impl Folder {
    /// Opens a folder whose pictures were taken `rate_hz` times a second.
    ///
    /// The numbers of the files are those of the frames if they go up by one but for a few that are
    /// missing; else the files follow each other without gaps.
    pub fn open(folder: &Path, rate_hz: f64) -> Result<Self, CameraError> {
        let paths = picture_files(folder)?;
        let size = one_size(&paths)?;
        let numbers: Option<Vec<usize>> = paths.iter().map(|path| number(path)).collect();
        let are_frames = |numbers: &Vec<usize>| {
            let rises = numbers.windows(2).all(|pair| pair[0] < pair[1]);
            let single = numbers.windows(2).filter(|pair| pair[1] == pair[0] + 1).count();
            // Half of the steps: time stamps in milliseconds never go up by one.
            rises && 2 * single + 2 >= numbers.len()
        };
        let counted = || (0..paths.len()).collect();
        let numbers = numbers.filter(are_frames).unwrap_or_else(counted);
        let missing = numbers.windows(2).flat_map(|pair| pair[0] + 1..pair[1]).collect();
        Ok(Self {
            files: numbers.into_iter().zip(paths).collect(),
            rate_hz,
            size,
            missing,
            next: 0,
        })
    }

    /// How many frames there are.
    pub fn count(&self) -> usize {
        self.files.len()
    }

    pub(super) fn next_frame(&mut self) -> Option<Frame> {
        let first = self.files.first()?.0;
        let (number, path) = self.files.get(self.next)?.clone();
        self.next += 1;
        let t_s = (number - first) as f64 / self.rate_hz;
        Some(Frame { number, t_s, content: Content::File(path) })
    }
}

/// A file's size stands within its first bytes: behind a thumbnail of a JPEG file, which has at most
/// 64 KiB, and its like.
const HEADING: u64 = 256 * 1024;

/// The size of all pictures, from their headings.
fn one_size(paths: &[PathBuf]) -> Result<[usize; 2], CameraError> {
    let size = |path: &PathBuf| {
        let wrong = |problem: String| CameraError::Picture { path: path.clone(), problem };
        let mut heading = Vec::new();
        File::open(path)
            .and_then(|file| file.take(HEADING).read_to_end(&mut heading))
            .map_err(|e| wrong(e.to_string()))?;
        decode::size(&heading).map_err(wrong)
    };
    let name = |path: &PathBuf| path.display().to_string();
    let first = paths.first().ok_or(CameraError::NoPictures)?;
    let of_first = size(first)?;
    for other in paths {
        let of_other = size(other)?;
        if of_other != of_first {
            let (first, other) = ((name(first), of_first), (name(other), of_other));
            return Err(CameraError::Sizes { first, other });
        }
    }
    Ok(of_first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Picture;

    #[test]
    fn numbers_give_the_times_and_what_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let picture = Picture::uniform(8, 6, 100.0);
        for n in [9, 10, 11, 14, 15] {
            picture.write(&folder.path().join(format!("frame{n}.png"))).unwrap();
        }
        let mut found = Folder::open(folder.path(), 10.0).unwrap();
        assert_eq!((found.size, &found.missing[..]), ([8, 6], &[12, 13][..]));
        let frames: Vec<_> = std::iter::from_fn(|| found.next_frame()).collect();
        assert_eq!(frames.iter().map(|f| f.number).collect::<Vec<_>>(), [9, 10, 11, 14, 15]);
        assert_eq!(frames[3].t_s, 0.5);
        assert_eq!(frames[0].picture().unwrap(), picture);

        Picture::uniform(9, 6, 1.0).write(&folder.path().join("frame16.png")).unwrap();
        let error = Folder::open(folder.path(), 10.0).unwrap_err().to_string();
        assert!(error.contains("frame9.png has 8x6") && error.contains("9x6"), "{error}");
    }

    #[test]
    fn time_stamps_in_names_are_no_frame_numbers() {
        let folder = tempfile::tempdir().unwrap();
        for n in [0, 33, 66, 100] {
            Picture::uniform(4, 4, 0.0).write(&folder.path().join(format!("{n}.png"))).unwrap();
        }
        let mut found = Folder::open(folder.path(), 30.0).unwrap();
        assert!(found.missing.is_empty());
        let last = std::iter::from_fn(|| found.next_frame()).last().unwrap();
        assert_eq!((last.number, last.t_s), (3, 0.1));
        let empty = tempfile::tempdir().unwrap();
        assert!(Folder::open(empty.path(), 30.0).unwrap_err().to_string().contains("no PNG"));
    }
}
