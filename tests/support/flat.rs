//! Several youBots side by side in one deployment, written flat: the shipped files once for each robot, with names of its own.

use std::fmt::Write;
use std::path::{Path, PathBuf};

const COMPONENTS: [&str; 13] = [
    "World",
    "youbot",
    "Arm_Kinematics",
    "Cart_Impedance",
    "Dynamics",
    "Base_Ctrl",
    "Link_Tx",
    "Link_Rx",
    "Peer",
    "Monitors",
    "Operator",
    "Mode_Switch",
    "Reporter",
];

/// What all robots hear: what begins and ends the deployment, and what components raise, which have the same types everywhere.
const COMMON: [&str; 18] = [
    "e_start",
    "e_shutdown",
    "e_done",
    "e_estop",
    "e_EMERGENCY_STOP",
    "e_OVERCURRENT",
    "e_OVERTEMP",
    "e_EC_TIMEOUT",
    "e_ENCODER_ERR",
    "e_UNDERVOLTAGE",
    "e_HALL_ERR",
    "e_SINE_COMM_INIT_ERR",
    "e_I2T_EXCEEDED",
    "e_cmd_watchdog",
    "e_base_cmd_watchdog",
    "e_5dof",
    "e_8dof",
    "e_JNT_SOFT_LIMIT_EXEEDED",
];

/// A robot's own names in a file.
struct Renamed<'t> {
    robot: &'t str,
    configurations: &'t [String],
}

impl Renamed<'_> {
    /// What stands between quotation marks.
    fn literal(&self, text: &str) -> String {
        let robot = self.robot;
        let end = text.find(['.', ':']).unwrap_or(text.len());
        let (first, rest) = text.split_at(end);
        let is_type = rest.strip_prefix('.').is_some_and(|member| member.starts_with(char::is_uppercase));
        if COMPONENTS.contains(&first) && !is_type {
            return format!("{robot}{first}{}", rest.replace(".is_", &format!(".is_{robot}")));
        }
        // Each has a bus of its own.
        if text == "sim0" {
            return format!("{robot}{text}");
        }
        if self.configurations.iter().any(|id| id == first) || ["profile", "brake"].contains(&text) {
            return format!("{robot}{text}");
        }
        match text.strip_prefix("e_") {
            Some(name) if !COMMON.contains(&text) => format!("e_{robot}{name}"),
            _ => text.to_owned(),
        }
    }

    fn file(&self, text: &str) -> String {
        let mut written = String::new();
        for line in listed(text).lines() {
            let indent = line.len() - line.trim_start().len();
            let declares = line.contains("= Configuration") || line.contains("= monitor");
            written.push_str(&line[..indent]);
            if declares {
                written.push_str(self.robot);
            }
            for (at, piece) in line[indent..].split('"').enumerate() {
                match at % 2 {
                    0 => written.push_str(piece),
                    _ => _ = write!(written, "\"{}\"", self.literal(piece)),
                }
            }
            written.push('\n');
        }
        written
    }
}

/// With every `_default` written out: of all components that its list does not name.
fn listed(text: &str) -> String {
    let (mut written, mut rest) = (String::new(), text);
    while let Some(at) = rest.find("\"_default:") {
        let open = rest[..at].rfind('{').expect("it stands in a list");
        let close = at + rest[at..].find('}').expect("that ends");
        let end = at + 1 + rest[at + 1..].find('"').expect("it ends");
        let state = &rest[at + "\"_default:".len()..end];
        let named = |name: &&str| !rest[open..close].contains(&format!("\"{name}:"));
        let entries: Vec<String> =
            COMPONENTS.into_iter().filter(|name| named(name)).map(|name| format!("\"{name}:{state}\"")).collect();
        written.push_str(&rest[..at]);
        written.push_str(&entries.join(", "));
        rest = &rest[end + 1..];
    }
    written + rest
}

/// Configurations of a file.
fn configurations(text: &str) -> impl Iterator<Item = String> + '_ {
    text.lines().filter_map(|line| Some(line.split_once("= Configuration")?.0.trim().to_owned()))
}

/// A coordinator's text without what it tells to whoever it is a part of, and waits for.
fn alone(text: &str) -> String {
    let text = text.replace("{ \"e_built\", \"connect_all\" }", "\"connect_all\"").replace("e_released", "e_done");
    text.replace("state { entry = \"e_leaving\" }", "state {}")
}

/// Writes the deployment of so many robots into a folder.
pub fn youbots(folder: &Path, robots: &[&str]) -> PathBuf {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/youbot");
    let names = ["coupling.lua", "configurations.lua", "coordinator.lua", "monitors.lua"];
    let read = |name: &str| alone(&std::fs::read_to_string(shipped.join(name)).expect("it is shipped"));
    let texts = names.map(read);
    let configurations: Vec<String> = texts[..2].iter().flat_map(|text| configurations(text)).collect();
    for robot in robots {
        let renamed = Renamed { robot, configurations: &configurations };
        for (name, text) in names.iter().zip(&texts) {
            std::fs::write(folder.join(format!("{robot}{name}")), renamed.file(text)).expect("a folder of ours");
        }
    }
    let each = |text: &str| {
        let all: Vec<String> = robots.iter().map(|robot| text.replace("ROBOT", robot)).collect();
        all.join(", ")
    };
    let deployment = format!(
        "davit: 1\nname: youbots\nplatform: embedded\nlibraries: [youbot]\nwith: {{ stand_in: true }}\n\
         activities:\n  world: {{ period_ms: 0.5, priority: 90 }}\n  control: {{ period_ms: 1.0, priority: 80 }}\n  link: {{ period_ms: 1.0, priority: 70 }}\n  \
         base: {{ period_ms: 4.0, priority: 60 }}\n  safety: {{ period_ms: 5.0, priority: 75 }}\n  \
         watch: {{ period_ms: 10.0, priority: 40 }}\n\
         configurations: [{}]\ncoordinators: {{ {} }}\nmonitors: [{}]\n\
         deploy: {{ event: e_start, up: [{}], failed: [{}], within_s: 20 }}\n\
         shutdown: {{ event: e_shutdown, down: [{}], within_s: 20, rest: [{}] }}\nlimits: {{ stack: 64, step_timeout_s: 1.0 }}\n\
         safety: [e_estop, e_EMERGENCY_STOP, e_OVERCURRENT, e_OVERTEMP, e_EC_TIMEOUT, e_ENCODER_ERR, \
         e_UNDERVOLTAGE, e_HALL_ERR, e_SINE_COMM_INIT_ERR, e_I2T_EXCEEDED]\n",
        each("ROBOTcoupling.lua, ROBOTconfigurations.lua"),
        each("ROBOT: ROBOTcoordinator.lua"),
        each("ROBOTmonitors.lua"),
        each("'ROBOT:operational'"),
        each("'ROBOT:deploy_failed'"),
        each("'ROBOT:idle'"),
        each("ROBOThold, ROBOTpark"),
    );
    let file = folder.join("youbots.yaml");
    std::fs::write(&file, deployment).expect("a folder of ours");
    file
}
