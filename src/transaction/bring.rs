//! What the way back brings back goes on to where safe configurations want it (semantics: *Safe configurations*).

use super::Transaction;
use super::back::WayBack;
use super::heed::height;
use crate::model::{ComponentName, MemberRef, RunState, Step};
use crate::system::{Overlay, View as _, step};

impl Transaction {
    /// What was destroyed when safe configurations came, and is brought back, goes on to where they want it, with the values that
    /// they wrote: nothing of it was there for them to bring anywhere, and their frames tell that they did. Nothing of it moves.
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
            self.write_as_wanted(component, view, way);
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

    /// What they wrote to one of these: a value that came only when it was being made again is not among those that it was
    /// made with.
    fn write_as_wanted(&self, component: ComponentName, view: &mut Overlay<'_>, way: &mut WayBack) {
        let of = |member: &&MemberRef| member.component == component;
        let properties = self.touched.properties.keys().filter(of).filter_map(|property| {
            let value = self.touched.properties[property].clone();
            let is = view.component(component)?.value(property.member)?;
            (*is != value).then_some(Step::PropertySet { property: *property, value })
        });
        let ports = self.touched.ports.keys().filter(of).filter_map(|port| {
            let value = self.touched.ports[port].clone();
            let is = step::written(*port, &*view)?;
            (is != value.as_ref()).then_some(Step::PortWrite { port: *port, value })
        });
        let mut writes: Vec<Step> = properties.chain(ports).collect();
        writes.sort_by_key(ToString::to_string);
        for write in writes {
            if !step::moves(&write, &*view) && step::apply(&write, view).is_ok() {
                way.add_behind(write);
                way.brings = true;
            }
        }
    }
}
