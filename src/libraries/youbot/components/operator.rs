//! `youbot.Operator` and `youbot.Mode_Switch`: the human in the simulation.

use super::samples::{ExtRef, ToolPose, ToolTwist};
use crate::libraries::youbot::hand::{Hand, HandScript};
use crate::model::EventName;
use crate::runtime::{Builder, Component, Context, EventOut, Failure, In, OperationAnswer, Out, Prop};
use nalgebra::Vector3;

/// The hand on this robot's tool.
pub struct Operator {
    tool_pose: In<ToolPose>,
    tool_twist: In<ToolTwist>,
    ext_ref: In<ExtRef>,
    control_mode: In<u8>,
    ext_force: Out<Vector3<f64>>,
    script: Prop<String>,
    hand_k: Prop<f64>,
    hand_b: Prop<f64>,
    f_max: Prop<f64>,
    insists: Prop<bool>,
    hand: Hand,
}

impl Component for Operator {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "A hand that follows a script from the moment it is started: free T; hold T; align T (to the other tool); \
             sway T X Y Z HERTZ; go T X Y Z; push T X Y Z.",
        )
        .on_configure(|c, _| c.begin())
        .on_start(|c, _| c.begin());
        b.doc("Begins another script now.").operation("load_script", |c, _, (text,): (String,)| {
            match text.parse::<HandScript>() {
                Ok(script) => {
                    c.hand.follow(script);
                    OperationAnswer::Done(())
                }
                Err(e) => OperationAnswer::failed(e.to_string()),
            }
        });
        Self {
            tool_pose: b
                .doc("Where the tool truly is: a hand feels the arm, not what a controller makes of it.")
                .input("tool_pose"),
            tool_twist: b.doc("How it truly moves.").input("tool_twist"),
            ext_ref: b.doc("Where the other tool is.").input("ext_ref"),
            control_mode: b
                .doc("What the drives do: a hand does not hold an arm that moves by itself. Not connected: 6.")
                .input("control_mode"),
            ext_force: b.doc("What the hand does to the tool, in the world.").unit("N").output("ext_force"),
            script: b.doc("What the hand does.").property("script", String::new()),
            hand_k: b.doc("Stiffness of the hand.").unit("N/m").range(0.0..=2000.0).property("hand_k", 300.0),
            hand_b: b.doc("Damping of the hand.").unit("N s/m").range(0.0..=200.0).property("hand_b", 30.0),
            f_max: b.doc("Strength of the hand.").unit("N").range(0.0..=200.0).property("f_max", 30.0),
            insists: b
                .doc("It does not let go of an arm that its drives hold, or move, by themselves.")
                .property("insists", false),
            hand: Hand::new(HandScript::default()),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        if self.script.changed()
            && let Err(Failure(why)) = self.begin()
        {
            return cx.fault(why);
        }
        let (Some(pose), Some(twist)) = (self.tool_pose.get(), self.tool_twist.get()) else { return };
        self.hand.stiffness = self.hand_k.get();
        self.hand.damping = self.hand_b.get();
        self.hand.f_max = self.f_max.get();
        let by_itself = self.control_mode.get().is_some_and(|mode| mode != 6);
        if by_itself && !self.insists.get() {
            return self.ext_force.write(Vector3::zeros());
        }
        let other = self.ext_ref.get().map(|r| Vector3::from(r.p));
        let force = self.hand.update(&pose.p.into(), &twist.v.into(), other.as_ref(), cx.dt());
        self.ext_force.write(force);
    }
}

impl Operator {
    fn begin(&mut self) -> Result<(), Failure> {
        let script = self.script.get_ref().parse::<HandScript>().map_err(|e| Failure::from_error(&e))?;
        self.hand.follow(script);
        Ok(())
    }
}

/// Events on a timetable: the operator's panel.
pub struct ModeSwitch {
    events: EventOut,
    script: Prop<String>,
    timetable: Vec<(f64, EventName)>,
    next: usize,
    elapsed: f64,
}

/// Entries of a timetable: it is written by hand.
const ENTRIES_MAX: usize = 1024;

impl Component for ModeSwitch {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Raises events at given seconds after it was started: `5 e_5dof; 8 e_8dof`.")
            .on_configure(|c, _| c.read())
            .on_start(|c, _| c.read());
        Self {
            events: b.doc("The events.").event_output("events"),
            script: b.doc("When to raise what.").property("script", String::new()),
            timetable: Vec::new(),
            next: 0,
            elapsed: 0.0,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        self.elapsed += cx.dt();
        while let Some((at, event)) = self.timetable.get(self.next)
            && *at <= self.elapsed
        {
            self.events.raise(*event);
            self.next += 1;
        }
    }
}

impl ModeSwitch {
    fn read(&mut self) -> Result<(), Failure> {
        self.timetable.clear();
        self.next = 0;
        self.elapsed = 0.0;
        for entry in self.script.get_ref().split(';').map(str::trim).filter(|e| !e.is_empty()) {
            let bad = || Failure(format!("`{entry}`: write SECONDS EVENT, separated by `;`"));
            let (at, event) = entry.split_once(char::is_whitespace).ok_or_else(bad)?;
            let at = at.parse::<f64>().ok().filter(|at| at.is_finite() && *at >= 0.0).ok_or_else(bad)?;
            let event = EventName::new(event.trim()).map_err(|_| bad())?;
            if self.timetable.len() >= ENTRIES_MAX {
                return Err(Failure(format!("more than {ENTRIES_MAX} entries")));
            }
            self.timetable.push((at, event));
        }
        self.timetable.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(())
    }
}
