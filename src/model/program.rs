//! The texts of a coordinator that has functions.

use super::finding::Origin;
use std::collections::BTreeMap;
use std::sync::Arc;

/// All that is needed to run the text of a coordinator once more, where its functions are to be called. A Lua state cannot
/// go from thread to thread; a text can.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// The coordinator's file, as findings name it.
    pub file: String,
    /// Its text.
    pub text: Arc<str>,
    /// Files that stand in for the host, with their texts; run before it, in this order.
    pub host: Vec<(String, Arc<str>)>,
    /// Files it loads (`rfsm.load`), by the name it gives them, with the name that findings give them and the text.
    pub files: BTreeMap<String, (String, Arc<str>)>,
    /// Values that it finds as globals (`with:`).
    pub with: Vec<(String, serde_json::Value)>,
    /// What is open to it.
    pub open: Openings,
    /// Functions that are called beside those of its chart.
    pub beside: Vec<AuxiliaryFunction>,
}

/// A function that is called beside those of the chart: `getevents`, a printer, a step hook.
#[derive(Debug, Clone, PartialEq)]
pub struct AuxiliaryFunction {
    /// What it belongs to, as findings name it: `` `root` ``, `` `a` → `b` ``.
    pub place: String,
    /// The key it stands under.
    pub part: String,
    /// The plugin that added it; none: the model.
    pub plugin: Option<String>,
    /// Where it stands.
    pub origin: Origin,
}

/// What of Lua is open to a trusted model beyond the language and its harmless libraries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Openings {
    /// Files and pipes: `io`.
    pub io: bool,
    /// Processes, the environment, the time of day: `os`.
    pub os: bool,
}

impl Openings {
    /// What can be opened, by name.
    pub const NAMES: [&'static str; 2] = ["io", "os"];
}
