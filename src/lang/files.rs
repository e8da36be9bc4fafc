//! Where texts come from: the disk, or memory.

use super::pipe::Pipe;
use crate::diagnostics::Language;
use crate::limits;
use crate::model::finding::did_you_mean;
use crate::model::{Code, Finding, codes};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// Where deployments are, below the folder of a project.
const DEPLOYMENTS: &str = "deployments";

/// A set of files.
#[derive(Debug, Clone, Default)]
pub enum Sources {
    /// The file system.
    #[default]
    Disk,
    /// Texts by path; nothing else exists. For tests and for programs that make their files.
    Memory(BTreeMap<PathBuf, Vec<u8>>),
}

impl Sources {
    /// Texts in memory.
    pub fn memory<P: Into<PathBuf>, T: Into<Vec<u8>>>(files: impl IntoIterator<Item = (P, T)>) -> Self {
        Self::Memory(files.into_iter().map(|(path, text)| (path.into(), text.into())).collect())
    }

    /// How a file is called where it is shown: without the folders that its path leads out of again, where that is the same file.
    pub fn shown(&self, path: &Path) -> String {
        let short = normal(path);
        let is_same = match self {
            Self::Memory(_) => true,
            Self::Disk => std::fs::canonicalize(&short).ok() == std::fs::canonicalize(path).ok(),
        };
        if is_same { short.display().to_string() } else { path.display().to_string() }
    }

    /// The text of a file: by size, then by encoding; nothing past the limit is ever read.
    ///
    /// # Errors
    /// A finding without a place.
    pub fn read(&self, path: &Path) -> Result<String, Box<Finding>> {
        self.read_named(path, None)
    }

    /// The same of one that a file names, which is not meant itself.
    ///
    /// # Errors
    /// A finding without a place.
    pub fn read_named(&self, path: &Path, by: Option<&str>) -> Result<String, Box<Finding>> {
        let near = |path: &Path| self.near(path, by);
        let shown = path.display();
        let refuse = |code: Code, message: String, help: String| Box::new(Finding::error(code, message).help(help));
        let too_large = || {
            let limit = limits::FILE_BYTES / 1024 / 1024;
            refuse(
                codes::TEXT_TOO_LARGE,
                format!("{shown} is larger than {limit} MB"),
                "split it, or check that it is the right file".to_owned(),
            )
        };
        let bytes = match self {
            Self::Memory(files) => match files.get(&normal(path)) {
                Some(bytes) if bytes.len() as u64 > limits::FILE_BYTES => return Err(too_large()),
                Some(bytes) => bytes.clone(),
                None => return Err(refuse(codes::TEXT_NO_FILE, format!("there is no file {shown}"), near(path))),
            },
            Self::Disk => {
                let cannot = |error: std::io::Error| {
                    if error.kind() == std::io::ErrorKind::NotFound {
                        refuse(codes::TEXT_NO_FILE, format!("there is no file {shown}"), near(path))
                    } else {
                        let help = "it must be a readable text file".to_owned();
                        refuse(codes::TEXT_UNREADABLE, format!("{shown} cannot be read: {error}"), help)
                    }
                };
                let meta = std::fs::metadata(path).map_err(cannot)?;
                if meta.is_dir() {
                    return Err(refuse(codes::TEXT_UNREADABLE, format!("{shown} is a folder"), self.in_folder(path)));
                }
                if meta.len() > limits::FILE_BYTES {
                    return Err(too_large());
                }
                let file: Box<dyn Read> = match meta.file_type().is_file() {
                    true => Box::new(File::open(path).map_err(cannot)?),
                    false => Box::new(Pipe::open(path, limits::PIPE_WAIT).map_err(cannot)?),
                };
                let mut bytes = Vec::with_capacity(usize::try_from(meta.len()).unwrap_or(0) + 1);
                // Pipes and growing files have no honest length: stop one byte past the limit.
                file.take(limits::FILE_BYTES + 1).read_to_end(&mut bytes).map_err(cannot)?;
                if bytes.len() as u64 > limits::FILE_BYTES {
                    return Err(too_large());
                }
                bytes
            }
        };
        // Some editors begin a text with a mark of its encoding, which is none of its letters.
        let text =
            |text: String| if text.starts_with('\u{feff}') { text['\u{feff}'.len_utf8()..].to_owned() } else { text };
        String::from_utf8(bytes).map(text).map_err(|error| {
            let valid = error.utf8_error().valid_up_to();
            let line = error.as_bytes()[..valid].iter().filter(|b| **b == b'\n').count() + 1;
            if error.as_bytes().starts_with(b"\x1bLua") {
                return refuse(
                    codes::LUA_BYTECODE,
                    format!("{shown} is compiled Lua"),
                    "only texts are read: give the source file".to_owned(),
                );
            }
            refuse(
                codes::TEXT_NOT_UTF8,
                format!("{shown} is not UTF-8: byte {valid} (line {line}) belongs to no character"),
                "save the file as UTF-8".to_owned(),
            )
        })
    }

    /// Files of a folder that was given in place of one of them: those that may be deployments first.
    fn in_folder(&self, folder: &Path) -> String {
        let mut names = self.inside(folder).unwrap_or_default();
        names.sort_by_key(|name| language(Path::new(name)) != Some(Language::Yaml));
        let named = |name: &String| format!("`{}`", normal(&folder.join(name)).display());
        let some: Vec<String> = names.iter().take(4).map(named).collect();
        match some.is_empty() {
            true => "name a file in it".to_owned(),
            false => format!("name a file in it, such as {}", some.join(", ")),
        }
    }

    /// Files near to a name that does not exist: in its folder, else in that for deployments below it.
    fn near(&self, path: &Path, by: Option<&str>) -> String {
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
        let Some(names) = self.inside(shown) else { return format!("there is no folder {} either", shown.display()) };
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        let near = |names: &[String]| {
            // A script is meant where a script is looked for.
            let same = |name: &&str| language(Path::new(name)).is_some() && language(Path::new(name)) == language(path);
            let others = || names.iter().map(String::as_str).filter(|name| by != Some(*name));
            let alike: Vec<&str> = others().filter(same).collect();
            let all = || others().collect();
            did_you_mean(name, "files", if alike.is_empty() { all() } else { alike })
        };
        if !names.is_empty() {
            return near(&names);
        }
        let below = shown.join(DEPLOYMENTS);
        match self.inside(&below).filter(|names| !names.is_empty()) {
            Some(names) => format!("in the folder {}: {}", normal(&below).display(), near(&names)),
            None => format!("no file in the folder {} is Lua, YAML or SCXML by its name", shown.display()),
        }
    }

    /// The names of the files in a folder that are in a language of ours; none: there is no such folder.
    fn inside(&self, folder: &Path) -> Option<Vec<String>> {
        Some(match self {
            Self::Memory(files) => {
                let folder = normal(folder);
                let inside = files.keys().filter(|p| p.parent() == Some(&folder));
                inside.filter_map(|p| Some(p.file_name()?.to_str()?.to_owned())).collect()
            }
            Self::Disk => {
                let list = std::fs::read_dir(folder).ok()?;
                let names = list.take(1_000).filter_map(|e| e.ok()?.file_name().into_string().ok());
                let mut names: Vec<_> = names.filter(|n| language(Path::new(n)).is_some()).collect();
                names.sort();
                names
            }
        })
    }
}

/// The language of a file, by its ending.
pub fn language(path: &Path) -> Option<Language> {
    match path.extension()?.to_str()? {
        "lua" => Some(Language::Lua),
        "yaml" | "yml" => Some(Language::Yaml),
        "scxml" => Some(Language::Scxml),
        _ => None,
    }
}

/// `a/b/../c` → `a/c`, as far as that can be said without the disk.
pub fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::Normal(_))) => {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out
}
