//! What a configuration did or stands for and is no longer so, as it is shown.

use crate::demo::{Demo, Ran};
use serde_json::Value;

fn script(demo: &Demo, text: &str) -> Ran {
    demo.write("script.lua", text);
    demo.run(&["run", "script.lua", "--clock", "simulated"])
}

#[test]
fn a_lie_is_found_by_looking() {
    let ran = script(
        &Demo::new(),
        "deploy('deployment.yaml')
         wait_answer('slow.ok', 1)
         fault('property_set source.k', 'lie')
         raise('e_fast')
         wait_answer('fast.ok', 1)
         assert(property('source.k') == 9, 'as far as is known')
         wait_answer('fast.lost', 10)
         assert(#drift() == 1)
         recover('back')
         assert(#drift() == 0 and property('source.k') == 9)
         shutdown()",
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("lost  fast.lost"), "{}", ran.out);
    assert!(ran.out.contains("the platform shows otherwise: `property_set source.k = 1.0`"), "{}", ran.out);
}

/// A running deployment; taken down whatever the test found.
struct Deployed(Demo);

impl Drop for Deployed {
    fn drop(&mut self) {
        let _ = self.0.command(&["shutdown", "--force"]).output();
    }
}

#[test]
fn what_cannot_be_seen_is_said_to_be_so() {
    let demo = Demo::new();
    demo.replace(
        "configurations.lua",
        "fast = Configuration { ",
        "fast = Configuration { holds = above(\"source.y\", 1.0), ",
    );
    let checked = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let found = |code: &str| checked["findings"].as_array().unwrap().iter().filter(|f| f["code"] == code).count();
    assert_eq!(found("conf::holds_unseen"), 1, "{checked}");
    assert_eq!(found("coord::lost_unheard"), 1, "in `fast_mode` nobody hears `fast.lost`: {checked}");
    let up = demo.run(&["deploy", "deployment.yaml", "--detach"]);
    assert_eq!(up.code, 0, "{}{}", up.out, up.err);
    let deployed = Deployed(demo);
    let fast = deployed.0.run(&["event", "e_fast", "--wait", "fast.ok"]);
    assert_eq!(fast.code, 0, "{}{}", fast.out, fast.err);
    let frames = deployed.0.run(&["stack", "--json"]).json();
    let frame: &Value = frames.as_array().unwrap().last().unwrap();
    assert_eq!((&frame["configuration"], &frame["unseen"]), (&"fast".into(), &true.into()), "{frames}");
    assert_eq!((&frame["lost"], &frame["partial"]), (&false.into(), &false.into()), "{frames}");
    for command in ["stack", "status"] {
        let shown = deployed.0.run(&[command]).out;
        assert!(shown.contains("not observed"), "{command}: {shown}");
    }
}
