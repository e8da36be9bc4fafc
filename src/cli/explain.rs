//! `davit explain CODE`

use super::exit::Exit;
use super::output::{Style, Table};
use super::{Answer, Context, Failure, Run};
use crate::model::codes::{self, CLI_UNKNOWN_CODE, PAGES, Page};
use crate::model::finding::did_you_mean;
use serde::Serialize;

/// Explain a finding: what happened, why it is refused, what to do.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The finding's code, as `conf::unknown_component` or `davit::conf::unknown_component`; without one, all codes are
    /// listed.
    code: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct View {
    code: &'static str,
    title: &'static str,
    text: &'static str,
}

impl From<&'static Page> for View {
    fn from(page: &'static Page) -> Self {
        Self { code: page.code.0, title: page.title, text: page.text }
    }
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let out = &context.out;
        let Some(code) = self.code else {
            if self.json {
                out.json(&PAGES.iter().map(View::from).collect::<Vec<_>>());
            } else {
                let mut table = Table::new(0);
                for page in PAGES {
                    table.row([out.paint(Style::Name, page.code), page.title.to_owned()]);
                }
                out.text(table.to_string());
            }
            return Ok(Exit::Done);
        };
        let Some(page) = codes::page(&code) else {
            let name = code.strip_prefix("davit::").unwrap_or(&code);
            return Err(Failure::no(
                CLI_UNKNOWN_CODE,
                format!("there is no finding with the code `{code}`"),
                format!(
                    "{}; `davit explain` lists all codes",
                    did_you_mean(name, "codes", PAGES.iter().map(|p| p.code.0))
                ),
            )
            .as_json(self.json));
        };
        if self.json {
            out.json(&View::from(page));
        } else {
            out.line(format!("{}: {}\n", out.paint(Style::Name, page.code), out.paint(Style::Bold, page.title)));
            out.text(wrap(page.text, 100));
        }
        Ok(Exit::Done)
    }
}

/// `text` in lines of at most `columns` characters; its own line breaks stay.
fn wrap(text: &str, columns: usize) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let mut used = 0;
        for word in line.split_whitespace() {
            let long = word.chars().count();
            if used > 0 && used + 1 + long > columns {
                out.push('\n');
                used = 0;
            }
            if used > 0 {
                out.push(' ');
                used += 1;
            }
            out.push_str(word);
            used += long;
        }
        out.push('\n');
    }
    out
}
