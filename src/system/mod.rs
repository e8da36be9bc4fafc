//! What is: the picture of a system, what a step means on it, and the difference of two systems.
//!
//! Pure: nothing here knows a platform, a thread, a clock or a file. A [`System`] is never wrong about itself: it changes
//! only through [`step::apply`] (a step whose precondition holds) and [`System::set_state`] (what a platform reports).

mod advice;
pub mod diff;
pub mod exclusive;
mod node;
mod overlay;
mod picture;
mod place;
mod reversibility;
mod so;
pub mod step;
mod system_graph;
pub mod touch;
mod violation;

pub use crate::model::MemberClass;
pub use diff::{diff, moves_any, without};
pub use node::{ComponentNode, Driven, Link, Written};
pub use overlay::Overlay;
pub use picture::Picture;
pub use place::SlotHandle;
pub use so::{is_seen_so, is_so};
pub use step::{Reversibility, Undo};
pub use system_graph::{System, UnknownType};
pub use touch::{Access, Slot, Touch};
pub use violation::{Violation, either};

use crate::model::{Catalogue, ComponentName, MemberRef, Policy, RunState, Value};

/// Reading a system: the real picture, or one with changes laid over it.
pub trait View {
    /// The component types known.
    fn types(&self) -> &Catalogue;
    /// The component of that name.
    fn component(&self, name: ComponentName) -> Option<&ComponentNode>;
    /// The policy of the connection between two ports, if there is one.
    fn link(&self, from: MemberRef, to: MemberRef) -> Option<Policy>;
    /// What drives an in-port.
    fn driven(&self, port: MemberRef) -> Driven;
    /// Calls `f` with every component, in an order that is the same every run.
    fn for_each_component(&self, f: &mut dyn FnMut(&ComponentNode));
    /// Calls `f` with every connection, in an order that is the same every run.
    fn for_each_link(&self, f: &mut dyn FnMut(MemberRef, MemberRef, Policy));
}

/// Writing a system. Only for the effects in [`step`]: nothing here checks anything.
pub trait ViewMut: View {
    /// Adds a component; its name is free.
    fn insert_component(&mut self, node: ComponentNode);
    /// Removes a component; it exists and has no connections.
    fn remove_component(&mut self, name: ComponentName);
    /// Adds a connection; both components exist.
    fn insert_link(&mut self, from: MemberRef, to: MemberRef, policy: Policy);
    /// Removes a connection that exists.
    fn remove_link(&mut self, from: MemberRef, to: MemberRef);
    /// A component that exists, to change it.
    fn touch(&mut self, name: ComponentName) -> &mut ComponentNode;
    /// Changes the components at both ends of a connection, one that is at both once.
    fn each_end(&mut self, from: MemberRef, to: MemberRef, change: fn(&mut ComponentNode)) {
        change(self.touch(from.component));
        if from.component != to.component {
            change(self.touch(to.component));
        }
    }
    /// Sets the run state of a component that exists.
    fn put_state(&mut self, name: ComponentName, state: RunState) {
        self.touch(name).state = state;
    }
    /// Sets the property at `index` of the type's order of a component that exists.
    fn put_property(&mut self, name: ComponentName, index: usize, value: &Value) {
        self.touch(name).properties[index].clone_from(value);
    }
    /// Records a written value of the port at `index` of the type's order, or that it was never written.
    fn put_port(&mut self, name: ComponentName, index: usize, value: Option<&Value>) {
        self.touch(name).put_port(index, value);
    }
}
