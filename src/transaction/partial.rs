//! The frame of what is neither done nor taken back.

use crate::model::ComponentName;
use crate::plan::footprint::{Footprint, Slot};
use crate::plan::undo::DraftStep;
use crate::stack::{Frame, Inverse};
use crate::system::touch::{self, Access};
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// Of the run states that are back where they were before it a partial frame says nothing any more.
pub(super) fn demand_no_more(frame: &mut Frame) {
    let open = |component: ComponentName| frame.moved(component).is_some();
    let touches = frame.footprint.touches.iter().copied();
    let touches =
        touches.filter(|touch| !matches!(touch.slot, Slot::State(of) if touch.access == Access::Write && !open(of)));
    frame.footprint = Arc::new(Footprint { touches: touches.collect() });
}

/// A frame of which only `items` are left to be undone; it is about these, and about `also`.
pub(super) fn partial(
    frame: &Frame,
    items: Vec<DraftStep>,
    also: &FxHashSet<ComponentName>,
    floor: Option<String>,
) -> Frame {
    let mut components: FxHashSet<ComponentName> =
        items.iter().flat_map(|item| touch::components(&item.step)).collect();
    components.extend(also);
    let slots: FxHashSet<_> = items.iter().filter_map(|item| touch::absolute(&item.step)).collect();
    let about = |component: &ComponentName| components.contains(component);
    let touches = (frame.footprint.touches.iter())
        .filter(|touch| {
            let (a, b) = touch.slot.components();
            about(&a) || about(&b)
        })
        .copied()
        .collect();
    Frame {
        inverse: Inverse::List(Arc::new(items)),
        footprint: Arc::new(Footprint { touches }),
        saved: frame.saved.iter().filter(|saved| slots.contains(&saved.slot)).cloned().collect(),
        floor,
        partial: true,
        ..frame.clone()
    }
}
