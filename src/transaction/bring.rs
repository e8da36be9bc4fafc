//! What the way back brings back goes on to where safe configurations want it (design §6).

use super::Transaction;
use super::back::WayBack;
use super::heed::height;
use crate::model::{ComponentName, RunState, Step};
use crate::system::{Overlay, View as _, step};

impl Transaction {
    /// What was destroyed when safe configurations came, and is brought back, goes on to where they want it: nothing of it was
    /// there for them to bring anywhere, and their frames tell that they did. Nothing of it moves.
    pub(super) fn bring_as_wanted(&self, view: &mut Overlay<'_>, way: &mut WayBack) {
        let destroyed =
            self.done_so_far().chain(self.taken_back_so_far()).filter_map(|(planned, _)| match planned.step {
                Step::Destroy { component } => Some(component),
                _ => None,
            });
        let mut components: Vec<ComponentName> = destroyed.collect();
        components.sort_unstable();
        components.dedup();
        for component in components {
            let Some(goal) = self.touched.wants(component) else { continue };
            let Some(now) = view.component(component).map(|node| node.state) else { continue };
            let Some(wanted) = goal.wanted().filter(|_| now != RunState::Faulted && height(goal) > height(now)) else {
                continue;
            };
            for transition in now.path_to(wanted) {
                let step = Step::State { component, transition: *transition };
                if step::moves(&step, &*view) || step::apply(&step, view).is_err() {
                    break;
                }
                way.add_behind(step);
                way.brings = true;
            }
        }
    }
}
