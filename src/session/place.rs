//! Where running deployments are found: a directory of the user's own with one socket each.

use std::fs;
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

/// Bytes that the path of a socket may have, as the operating system has it.
pub const LONGEST: usize = 107;

/// The directory of the control sockets: `$XDG_RUNTIME_DIR/davit`, else `davit-UID` in the system's directory for
/// temporary files.
pub fn directory() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR").filter(|d| !d.is_empty()) {
        Some(runtime) => PathBuf::from(runtime).join("davit"),
        None => {
            let user = fs::metadata("/proc/self").map_or(0, |m| m.uid());
            std::env::temp_dir().join(format!("davit-{user}"))
        }
    }
}

/// The socket of the deployment of that name.
pub fn socket(name: &str) -> PathBuf {
    directory().join(format!("{name}.sock"))
}

/// Makes the directory, for its owner alone.
///
/// # Errors
/// When it cannot be made, or when it is there and others than its owner may enter it (in a shared directory for
/// temporary files somebody else could have made it first).
pub fn prepare(directory: &Path) -> io::Result<()> {
    fs::DirBuilder::new().recursive(true).mode(0o700).create(directory)?;
    let metadata = fs::metadata(directory)?;
    let me = fs::metadata("/proc/self").map_or(metadata.uid(), |m| m.uid());
    if metadata.uid() != me {
        return Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            format!("{} belongs to another user", directory.display()),
        ));
    }
    if metadata.permissions().mode() & 0o077 != 0 {
        fs::set_permissions(directory, fs::Permissions::from_mode(0o700))?;
    }
    Ok(())
}

/// The names of the deployments that answer on their sockets, in alphabetical order. A socket that nobody listens on is left
/// of a process that was killed; it stays until that name is deployed again: only who owns a name removes its socket.
pub fn running() -> Vec<String> {
    let Ok(entries) = fs::read_dir(directory()) else { return Vec::new() };
    let mut names: Vec<String> = entries
        .filter_map(Result::ok)
        .map(|e| e.path())
        .filter(|p| p.extension().is_some_and(|e| e == "sock"))
        .filter(|p| is_alive(p))
        .filter_map(|p| p.file_stem().map(|s| s.to_string_lossy().into_owned()))
        .collect();
    names.sort();
    names
}

/// Whether somebody listens on the socket.
pub fn is_alive(socket: &Path) -> bool {
    UnixStream::connect(socket).is_ok()
}

/// A file, known by what it is and not by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Known {
    device: u64,
    inode: u64,
}

impl Known {
    /// The file of that name.
    ///
    /// # Errors
    /// When there is none.
    pub fn at(path: &Path) -> io::Result<Self> {
        fs::symlink_metadata(path).map(|m| Self { device: m.dev(), inode: m.ino() })
    }

    /// Removes it, if it still has that name.
    pub fn remove(self, path: &Path) {
        if Self::at(path).is_ok_and(|there| there == self) {
            let _ = fs::remove_file(path);
        }
    }
}
