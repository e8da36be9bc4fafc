//! A program of one's own with components of one's own: all of `davit`, and a library beside the built-in ones.
//!
//! ```sh
//! cargo run --example own_components -- types mine.LowPass
//! cargo run --example own_components -- check examples/own_components/deployment.yaml
//! cargo run --example own_components -- deploy examples/own_components/deployment.yaml
//! cargo run --example own_components -- run examples/own_components/gripper_story.lua --clock simulated
//! ```

#[path = "own_components/gripper.rs"]
mod gripper;

use davit::component::{Builder, Component, Context, In, Library, OperationAnswer, Out, Prop};

/// A first-order low-pass filter.
struct LowPass {
    u: In<f64>,
    y: Out<f64>,
    time_constant: Prop<f64>,
    state: Option<f64>,
}

impl Component for LowPass {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("First-order low-pass filter: y follows u with a time constant. Starts at the first sample.");
        b.doc("Forgets what came before: the next sample is passed as it is.").no_effect();
        b.operation("reset", |this: &mut Self, _: &mut Context, ()| {
            this.state = None;
            OperationAnswer::Done(())
        });
        Self {
            u: b.doc("What comes in.").input("u"),
            y: b.doc("What is left of it.").output("y"),
            time_constant: b.doc("Time constant.").unit("s").range(0.001..=100.0).property("time_constant", 0.1),
            state: None,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some(u) = self.u.get() else { return };
        let tau = self.time_constant.get();
        let dt = cx.dt();
        let y = self.state.map_or(u, |y| y + (u - y) * (1.0 - (-dt / tau).exp()));
        self.state = Some(y);
        self.y.write(y);
    }
}

fn main() -> std::process::ExitCode {
    let mine = Library::new("mine").with::<LowPass>("mine.LowPass").with::<gripper::Gripper>("mine.Gripper");
    davit::main(davit::builtin().with(mine))
}
