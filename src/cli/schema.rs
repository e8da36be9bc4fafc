//! `davit schema`

use super::exit::Exit;
use super::{CommandContext, CommandResult, Run, write_output};
use crate::lang::grammar::{FILES, File};
use crate::lang::schema;
use clap::ValueEnum;
use std::path::PathBuf;

/// What editors need to complete and to underline: JSON Schema of the files in YAML, annotations (LuaCATS) for those in Lua; or the
/// reference for people.
///
/// For a YAML file, write the schema beside it and name it in the first line: `# yaml-language-server: $schema=deployment.json`. For
/// Lua, write `davit schema lua -o davit.lua` into a folder that the language server has as a library. `davit explain KEY` shows one
/// key.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which file.
    #[arg(value_enum, default_value_t = SchemaOf::Deployment, value_name = "KIND")]
    of: SchemaOf,
    /// Write the page of the reference (Markdown) instead of the schema; of `lua`, the pages of all that Lua is written in.
    #[arg(long)]
    markdown: bool,
    /// Write to this file instead of printing.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SchemaOf {
    /// A deployment.
    Deployment,
    /// Configurations, in YAML.
    Configurations,
    /// A coordinator, in YAML.
    Coordinator,
    /// Monitors, in YAML.
    Monitors,
    /// Configurations, coordinators and monitors in Lua.
    Lua,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let of = self.of.to_possible_value();
        let text = match of.and_then(|of| File::named(of.get_name())) {
            Some(file) if self.markdown => schema::markdown(file),
            Some(file) => format!("{:#}\n", schema::json_schema(file, &context.extensions.names())),
            // Each page has both languages.
            None if self.markdown => {
                let pages: Vec<_> = FILES.iter().filter(|file| file.in_lua).map(schema::markdown).collect();
                pages.join("\n")
            }
            None => schema::annotations(),
        };
        write_output(context, self.output.as_deref(), &text)?;
        Ok(Exit::Done)
    }
}
