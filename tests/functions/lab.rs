//! Lua texts that make and step machines of their own.

use davit::functions::Lab;
use davit::model::program::Openings;
use std::collections::BTreeMap;

const PREAMBLE: &str = r#"
rfsm = require "rfsm"
function eq(is, should, what)
  local function text(v)
    if type(v) ~= "table" then return tostring(v) end
    local out = {}
    for i, x in ipairs(v) do out[i] = tostring(x) end
    return table.concat(out, " ")
  end
  if text(is) ~= text(should) then
    error((what or "") .. " is <" .. text(is) .. ">, should be <" .. text(should) .. ">", 2)
  end
end
lines = {}
function say(...)
  local out = {}
  for i, x in ipairs { ... } do out[i] = tostring(x) end
  lines[#lines + 1] = table.concat(out)
end
-- Machines that tell what their printers are told.
function init(t)
  t.err, t.warn, t.info = t.err or say, t.warn or say, t.info or function() end
  return rfsm.init(t)
end
function leaf(fsm) return rfsm.get_actleaf_fqn(fsm) end
S, T, C = rfsm.state, rfsm.trans, rfsm.conn
"#;

/// Runs a text after some helpers (`eq`, `say`, `init`, `leaf`, `S`, `T`, `C`); its errors fail the test.
pub fn run(text: &str) -> Vec<serde_json::Value> {
    run_with(&[], text)
}

/// The same, with files that it may load.
pub fn run_with(files: &[(&str, &str)], text: &str) -> Vec<serde_json::Value> {
    told_with(files, text).0
}

/// The same as [`run`]; answers what was printed: the printer and the text.
pub fn told(text: &str) -> Vec<String> {
    told_with(&[], text).1
}

fn told_with(files: &[(&str, &str)], text: &str) -> (Vec<serde_json::Value>, Vec<String>) {
    let files: BTreeMap<String, String> = files.iter().map(|(name, text)| ((*name).into(), (*text).into())).collect();
    let lab = Lab::new(files, Openings::default()).expect("a lab");
    lab.run("preamble", PREAMBLE).expect("the preamble runs");
    match lab.run("test", text) {
        Ok(values) => {
            let said = lab.said().into_iter().map(|said| format!("{:?} {}", said.by, said.text));
            (values, said.collect())
        }
        Err(failure) => panic!("{failure}\nprinted: {:?}", lab.said()),
    }
}
