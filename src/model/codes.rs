//! Every code a finding or an operational error may carry, in one list, with the page `davit explain CODE` prints.
//!
//! A code is never reused for another meaning. Each page says what happened, why it is refused, and what to do.

/// A stable code, `area::name`; printed as `davit::area::name`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Code(pub &'static str);

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

impl std::fmt::Debug for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

impl serde::Serialize for Code {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0)
    }
}

/// A code with its page.
#[derive(Debug, Clone, Copy)]
pub struct Page {
    /// The code.
    pub code: Code,
    /// One line.
    pub title: &'static str,
    /// What happened, why it is refused, what to do.
    pub text: &'static str,
}

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $title:literal, $text:literal;)*) => {
        $(
            #[doc = $title]
            pub const $name: Code = Code($code);
        )*

        /// All pages, in the order of the list.
        pub const PAGES: &[Page] = &[$(Page { code: $name, title: $title, text: $text }),*];
    };
}

codes! {
    // ---- text and files (lang) -------------------------------------------------------------------------------------
    // ---- deployment and types --------------------------------------------------------------------------------------
    // ---- configurations and plans ----------------------------------------------------------------------------------
    // ---- stack -----------------------------------------------------------------------------------------------------
    // ---- coordinators (statecharts) --------------------------------------------------------------------------------
    // ---- run time: platform, configurator, session -----------------------------------------------------------------
    // ---- youbot and standard libraries -----------------------------------------------------------------------------
    // ---- command line ----------------------------------------------------------------------------------------------
    CLI_UNKNOWN_CODE = "cli::unknown_code", "there is no finding with this code",
        "`davit explain` was asked about a code that no finding carries. Codes are printed with every finding, as \
         `davit::area::name`; the leading `davit::` may be left out. `davit explain` without a code lists all of them.";
    CLI_NOT_RUNNING = "cli::not_running", "there is no such running deployment",
        "The command talks to a running deployment through its control socket, and none of that name (or none at all) \
         answers. Start one with `davit deploy FILE`. Sockets are looked for in $XDG_RUNTIME_DIR/davit: a deployment \
         started by another user, or with another value of that variable, is not seen.";
    CLI_SEVERAL_RUNNING = "cli::several_running", "several deployments are running",
        "The command was given no name and more than one deployment is running, so it is not known which is meant. \
         Give the name: `davit status NAME`, `davit event E --on NAME`.";
    CLI_NO_ANSWER = "cli::no_answer", "the running deployment does not answer",
        "The control socket is there and something listens on it, but no answer came in time, or the connection was \
         closed. The deployment may just have ended: `davit status` tells. If it is stuck, `davit shutdown --force` \
         takes it down without its coordinator.";
    CLI_REFUSED = "cli::refused", "the running deployment refused",
        "The running deployment understood the request and said no; the message is its own. An unknown event or \
         configuration is refused at once; a wait that ran out is told as such, and the request itself may still be \
         answered: `davit log` shows it.";
}

/// The page of `code`, written with or without the leading `davit::`.
pub fn page(code: &str) -> Option<&'static Page> {
    let code = code.strip_prefix("davit::").unwrap_or(code);
    PAGES.iter().find(|page| page.code.0 == code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_unique_and_explained() {
        for (i, page) in PAGES.iter().enumerate() {
            assert!(PAGES[i + 1..].iter().all(|other| other.code != page.code), "{} stands twice", page.code);
            assert!(page.code.0.split("::").count() == 2, "{} is not area::name", page.code);
            assert!(page.text.len() > 60, "{} has no real page", page.code);
        }
    }
}
