//! Reads a file, whose format its content tells.

use crate::contents::{Contents, FileError};
use crate::{markups, obj, ply, surface, table, vtk};

impl Contents {
    /// Reads a file of any format.
    pub fn read(bytes: &[u8]) -> Result<Self, FileError> {
        let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes).trim_ascii_start();
        let contents = if text.starts_with(b"# vtk DataFile") {
            let fix = "save it as VTP, for example with ParaView or `vmtksurfacewriter`";
            return Err(FileError::new("this is a file of VTK's older format", fix));
        } else if text.starts_with(b"<?xml") || text.starts_with(b"<VTKFile") {
            vtk::read(text)?
        } else if text.starts_with(b"ply") {
            ply::read(text)?
        } else if text.starts_with(b"{") {
            markups::read(text)?
        } else if obj::is_one(text) {
            obj::read(text)?
        } else if !text.starts_with(b"solid") && table::is_one(text) {
            table::read(text)?
        } else {
            surface::read_stl(bytes)?
        };
        contents.check()
    }
}
