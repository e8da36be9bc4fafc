//! Bounds of texts: deployments, configurations, statecharts.

use std::time::Duration;

/// Bytes of one text file. A generated deployment of 100,000 components takes about 10 MB; a file past this is refused
/// by its size, before it is read.
pub const FILE_BYTES: u64 = 16 * 1024 * 1024;

/// Letters of a deployment's name. It is the name of its socket, whose whole path may have 107 bytes.
pub const DEPLOYMENT_NAME: usize = 64;

/// How long a pipe that is given as a file is waited for, each time: what writes it may look something up first.
pub const PIPE_WAIT: Duration = Duration::from_secs(30);

/// Levels of nesting of a text: values and statecharts written by people stay below ten.
pub const TEXT_DEPTH: usize = 64;

/// Nodes of a text after its aliases are expanded: bounds what a few lines of aliases can unfold to.
pub const TEXT_NODES: usize = 1_000_000;

/// Bytes of text that are looked through for globals that nobody has set, counted once for each such name: a model that asks for
/// many in a large text is not searched for ever.
pub const SLIP_BYTES: usize = 64 * 1024 * 1024;

/// Bytes of large elements ([`PLACE_LARGE`]) in which the words are looked for that findings are about; past it a finding points at the
/// element around them. Some seconds, for files that mean harm.
pub const PLACE_BYTES: usize = 32 * 1024 * 1024;

/// Bytes of an element that is large: one that people write has some hundreds.
pub const PLACE_LARGE: usize = 64 * 1024;

/// Names that one event of a foreign SCXML document is taken to mean beside itself (those that begin with it); past it a warning
/// says that they are not all.
pub const SCXML_NAMES: usize = 100;

/// Findings collected from the texts of one deployment; past it reading stops, since the rest follows from the first.
pub const FINDINGS: usize = 1_000;
