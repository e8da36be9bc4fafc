//! A file of lines with a bound: when it is full it becomes the older of two, and the one before is gone.

use super::reading::{AS_IT_IS, a_file};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Where the older one is.
pub fn older(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".1");
    name.into()
}

/// The file, open to be added to.
pub struct Rotating {
    path: PathBuf,
    file: File,
    size: u64,
    bound: u64,
    /// The last line may have been written in part: the next one begins anew.
    torn: bool,
}

impl Rotating {
    /// Opens it behind what is there already.
    pub fn open(path: PathBuf, bound: u64) -> io::Result<Self> {
        let file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .mode(0o600)
            .custom_flags(AS_IT_IS)
            .open(&path)
            .and_then(a_file)?;
        let size = file.metadata()?.len();
        // Whoever wrote before may have been killed in the middle.
        let mut last = [0];
        let whole = size == 0 || file.read_exact_at(&mut last, size - 1).is_ok() && last == *b"\n";
        Ok(Self { path, file, size, bound, torn: !whole })
    }

    /// Adds a line. Where a new file begins with it, `head` stands before it.
    pub fn line(&mut self, line: &str, head: impl FnOnce() -> String) -> io::Result<()> {
        let length = line.len() as u64 + 1;
        if self.size > 0 && self.size + length > self.bound {
            // Somebody may have removed it; then there is nothing that could become the older one.
            let _ = fs::rename(&self.path, older(&self.path));
            *self = Self::open(self.path.clone(), self.bound)?;
            self.write(&head())?;
        }
        self.write(line)
    }

    fn write(&mut self, line: &str) -> io::Result<()> {
        let text = format!("{}{line}\n", if self.torn { "\n" } else { "" });
        self.torn = true;
        self.file.write_all(text.as_bytes())?;
        self.torn = false;
        self.size += text.len() as u64;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_files_of_the_bound_are_all_there_ever_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.log");
        let mut file = Rotating::open(path.clone(), 1000).unwrap();
        for number in 0..500 {
            file.line(&format!("line {number}"), || "goes on".to_owned()).unwrap();
            let sizes = [&path, &older(&path)].map(|path| fs::metadata(path).map_or(0, |it| it.len()));
            assert!(sizes.iter().all(|size| *size <= 1000), "{sizes:?}");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
        let newest = fs::read_to_string(&path).unwrap();
        assert!(newest.starts_with("goes on\n") && newest.ends_with("line 499\n"), "{newest}");
        // Cut off in the middle of a line, as by the end of a process: what comes next is whole.
        fs::write(&path, "{\"half").unwrap();
        let mut file = Rotating::open(path.clone(), 1000).unwrap();
        file.line("whole", String::new).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap().lines().last(), Some("whole"));
    }
}
