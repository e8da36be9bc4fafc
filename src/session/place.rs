//! Where running deployments are found: a directory of the user's own with one socket each.

use std::fs;
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

/// Bytes that the path of a socket may have, as the operating system has it.
pub const LONGEST: usize = 107;

/// The directory of the control sockets: `$XDG_RUNTIME_DIR/davit`, else `davit-UID` in the system's directory for
/// temporary files. A path that is not absolute counts for nothing (XDG Base Directory Specification).
pub fn directory() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR").filter(|dir| Path::new(dir).is_absolute()) {
        Some(runtime) => PathBuf::from(runtime).join("davit"),
        None => std::env::temp_dir().join(format!("davit-{}", user())),
    }
}

/// The socket of the deployment of that name.
pub fn socket(name: &str) -> PathBuf {
    directory().join(format!("{name}.sock"))
}

/// The user of this process.
pub fn user() -> u32 {
    // SAFETY: it asks for a number, and cannot fail.
    unsafe { libc::geteuid() }
}

/// What another user may have put there, or may change.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} {why}", path.display())]
pub struct Untrusted {
    path: PathBuf,
    why: &'static str,
}

/// Whether the directory of the control sockets is there and is the user's own. In a shared directory for temporary files
/// somebody else could have made it first.
///
/// # Errors
/// [`Untrusted`]: it is a symbolic link, another user's, or others may write to it.
pub fn is_there() -> Result<bool, Untrusted> {
    let path = directory();
    let Ok(it) = fs::symlink_metadata(&path) else { return Ok(false) };
    match not_own(&it).or((it.mode() & 0o022 != 0).then_some("can be written by other users")) {
        None if it.is_dir() => Ok(true),
        None => Ok(false),
        Some(why) => Err(Untrusted { path, why }),
    }
}

/// Why a file is not simply the user's own.
fn not_own(it: &fs::Metadata) -> Option<&'static str> {
    if it.is_symlink() {
        Some("is a symbolic link, which could lead to another user's")
    } else {
        (it.uid() != user()).then_some("belongs to another user")
    }
}

/// Why nobody could be reached on a socket.
#[derive(Debug, thiserror::Error)]
pub enum Unreached {
    /// Nobody listens there.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Whoever listens there is not the user.
    #[error(transparent)]
    Untrusted(#[from] Untrusted),
}

/// Connects to a socket, if both the file and the process behind it are the user's own.
///
/// # Errors
/// [`Unreached`].
pub fn reach(socket: &Path) -> Result<UnixStream, Unreached> {
    let untrusted = |why| Unreached::Untrusted(Untrusted { path: socket.to_owned(), why });
    if let Some(why) = not_own(&fs::symlink_metadata(socket)?) {
        return Err(untrusted(why));
    }
    let stream = UnixStream::connect(socket)?;
    // Whoever the file belongs to: this is the process that will answer.
    if is_own(&stream) { Ok(stream) } else { Err(untrusted("is listened on by another user's process")) }
}

/// Whether the process at the other end is the user's own.
pub fn is_own(stream: &UnixStream) -> bool {
    peer(stream).is_some()
}

/// The process at the other end, where it is the user's own.
pub fn peer(stream: &UnixStream) -> Option<libc::pid_t> {
    let mut peer = libc::ucred { pid: 0, uid: u32::MAX, gid: u32::MAX };
    let mut length = libc::socklen_t::try_from(size_of::<libc::ucred>()).unwrap_or_default();
    // SAFETY: the descriptor is open as long as `stream`, and there is room for `length` bytes at `peer`, which is plain numbers.
    let answer = unsafe {
        let at = (&raw mut peer).cast();
        libc::getsockopt(stream.as_raw_fd(), libc::SOL_SOCKET, libc::SO_PEERCRED, at, &raw mut length)
    };
    (answer == 0 && peer.uid == user()).then_some(peer.pid)
}

/// Makes the directory, for its owner alone.
///
/// # Errors
/// When it cannot be made, or when it is there and is not simply the user's own.
pub fn prepare(directory: &Path) -> io::Result<()> {
    fs::DirBuilder::new().recursive(true).mode(0o700).create(directory)?;
    let it = fs::symlink_metadata(directory)?;
    if let Some(why) = not_own(&it) {
        let untrusted = Untrusted { path: directory.to_owned(), why };
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, untrusted));
    }
    if it.permissions().mode() & 0o077 != 0 {
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

/// Whether a process of the user listens on the socket.
pub fn is_alive(socket: &Path) -> bool {
    reach(socket).is_ok()
}

/// A file, known by what it is and not by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KnownName {
    device: u64,
    inode: u64,
}

impl KnownName {
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
