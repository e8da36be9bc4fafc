//! `davit new FOLDER`

use super::exit::Exit;
use super::output::{Style, Table};
use super::{CommandContext, CommandFailure, CommandResult, Run, write_output};
use crate::model::Ident;
use crate::model::codes::{CLI_NOT_EMPTY, CLI_UNWRITABLE, TEXT_BAD_NAME};
use serde_json::json;
use std::io;
use std::path::{Path, PathBuf};

/// Begin a deployment: files that are accepted as they stand, and a first script.
///
/// A motor on the simulated platform, with two speeds, an emergency stop and a coordinator: small, but all of it. The files say
/// what each part is for; `davit explain KEY` explains every key.
#[derive(Debug, clap::Args)]
#[command(alias = "init")]
pub struct Args {
    /// The folder: made, or there and empty.
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// The deployment's name. Without it: what the folder is called.
    #[arg(long, value_name = "NAME", value_parser = super::remote::deployment_name)]
    name: Option<String>,
    /// Write configurations and coordinator in Lua, as the paper does.
    #[arg(long)]
    lua: bool,
    /// Print as JSON which files were written.
    #[arg(long)]
    json: bool,
}

/// The files, with what each is for.
const DEPLOYMENT: &str = include_str!("scaffold/deployment.yaml");
const STORY: &str = include_str!("scaffold/story.lua");
const IN_YAML: [&str; 2] = [include_str!("scaffold/configurations.yaml"), include_str!("scaffold/coordinator.yaml")];
const IN_LUA: [&str; 2] = [include_str!("scaffold/configurations.lua"), include_str!("scaffold/coordinator.lua")];

impl Args {
    /// The folder's own name, unless another one is given.
    fn name(&self) -> Result<String, CommandFailure> {
        if let Some(name) = &self.name {
            return Ok(name.clone());
        }
        // Of `.` too, and of `a/..`.
        let whole = std::path::absolute(&self.folder).unwrap_or_else(|_| self.folder.clone());
        let whole = std::fs::canonicalize(&whole).unwrap_or(whole);
        let name = whole.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        match Ident::new(&name) {
            Ok(_) => Ok(name),
            Err(error) => Err(CommandFailure::usage(
                TEXT_BAD_NAME,
                error.to_string(),
                "a deployment is called like its folder; give it another name: `--name arm`",
            )),
        }
    }
}

/// Makes the folder; nothing that is there is touched.
fn make(folder: &Path) -> Result<(), CommandFailure> {
    let unwritable = |error: io::Error| {
        let message = format!("{}: {error}", folder.display());
        CommandFailure::usage(CLI_UNWRITABLE, message, "name a folder that can be made")
    };
    std::fs::create_dir_all(folder).map_err(unwritable)?;
    match std::fs::read_dir(folder).map_err(unwritable)?.next() {
        None => Ok(()),
        Some(_) => {
            let message = format!("{}: the folder is there, and not empty", folder.display());
            Err(CommandFailure::no(CLI_NOT_EMPTY, message, "name a folder that is not there yet, or an empty one"))
        }
    }
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let name = self.name()?;
        make(&self.folder)?;
        let (language, [configurations, coordinator]) = if self.lua { ("lua", IN_LUA) } else { ("yaml", IN_YAML) };
        let deployment = DEPLOYMENT.replace("name: NAME\n", &format!("name: {name}\n")).replace("LANGUAGE", language);
        let files = [
            ("deployment.yaml".to_owned(), deployment.as_str(), "what there is, and how it comes up and goes down"),
            (format!("configurations.{language}"), configurations, "what can be applied, and is taken back"),
            (format!("coordinator.{language}"), coordinator, "when: states, events, and what each asks for"),
            ("story.lua".to_owned(), STORY, "what must be so, in simulated time"),
        ];
        let mut table = Table::new(0);
        let mut written = Vec::new();
        for (file, text, what) in files {
            let path = self.folder.join(file);
            write_output(context, Some(&path), text)?;
            table.row([path.display().to_string(), context.out.paint(Style::Dim, what).to_string()]);
            written.push(path);
        }
        if self.json {
            context.out.json(&json!({ "name": name, "files": written }));
            return Ok(Exit::Done);
        }
        let of = |file: &str| self.folder.join(file).display().to_string();
        context.out.text(format!(
            "{table}\nNext:\n  davit check {deployment}\n  davit run {story} --clock simulated\n  davit deploy {deployment}   \
             # Ctrl-C leads it down; in another terminal: davit event e_faster, davit watch\n",
            deployment = of("deployment.yaml"),
            story = of("story.lua"),
        ));
        Ok(Exit::Done)
    }
}
