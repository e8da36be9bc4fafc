//! Reading the files of what is kept: each is read to its bound and no further, and never waited for, whatever somebody has put
//! in its place.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// Opens a file to read it.
///
/// # Errors
/// When it cannot be opened, or is something else than a file (a pipe would be waited for).
pub fn opened(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).custom_flags(AS_IT_IS).open(path).and_then(a_file)
}

/// How the files are opened: nobody is waited for, and no symbolic link is followed, as with the control socket.
pub const AS_IT_IS: i32 = libc::O_NONBLOCK | libc::O_NOFOLLOW;

/// What was opened, if it is a file.
///
/// # Errors
/// When it is something else.
pub fn a_file(file: File) -> io::Result<File> {
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(io::Error::other("it is no file")),
    }
}

/// The last bytes of a file, at most so many.
///
/// # Errors
/// As [`opened`], and when it cannot be read.
pub fn end_of(mut file: &File, at_most: u64) -> io::Result<Vec<u8>> {
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(at_most)))?;
    let mut bytes = Vec::new();
    file.take(at_most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_long_is_read_from_its_end_and_what_is_no_file_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        std::fs::write(&path, "0123456789").unwrap();
        let read = |path: &Path, at_most| end_of(&opened(path)?, at_most);
        assert_eq!(read(&path, 100).unwrap(), b"0123456789");
        assert_eq!(read(&path, 4).unwrap(), b"6789");
        let pipe = folder.path().join("pipe");
        let name = std::ffi::CString::new(pipe.to_str().unwrap()).unwrap();
        // SAFETY: a name that ends with a zero.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        for wrong in [&pipe, folder.path(), Path::new("/dev/zero")] {
            assert!(read(wrong, 4).is_err(), "{}", wrong.display());
        }
    }
}
