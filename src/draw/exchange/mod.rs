//! A coordinator in forms that other programs read: PlantUML and rFSM's JSON.

mod json;
mod plantuml;

pub use json::coordinator_json;
pub use plantuml::coordinator_plantuml;

#[cfg(test)]
mod tests {
    use crate::model::names::{ConfigId, EventName, Ident};
    use crate::model::statechart::{Action, ChartNode, ChartTransition, Connector, State, Statechart, Trigger};

    fn raise(name: &str) -> (Action, crate::model::Origin) {
        (Action::Raise(EventName::new(name).unwrap()), Default::default())
    }

    fn trans(src: &str, tgt: &str, events: &[&str]) -> ChartTransition {
        ChartTransition::new(src, tgt, events.iter().map(|e| Trigger::parse(e).unwrap()))
    }

    /// One of everything.
    pub fn sample() -> Statechart {
        let state = |name: &str| State::new(Ident::new(name).unwrap());
        let (mut low, mut on, mut root) = (state("low"), state("on"), state("root"));
        low.entry.push(raise("e_low"));
        on.config.push((ConfigId::new("power").unwrap(), Default::default()));
        on.children = vec![ChartNode::State(low), ChartNode::State(state("high"))];
        on.transitions = vec![trans("initial", "low", &[]), trans("low", "high", &["e_done", "e_after(1)"])];
        let mut go = trans("idle", "fork", &["e_go"]);
        go.pn = 2.0;
        go.effect.push(raise("e_gone"));
        root.children = vec![
            ChartNode::State(state("idle")),
            ChartNode::State(on),
            ChartNode::Connector(Connector::new(Ident::new("fork").unwrap())),
        ];
        root.transitions =
            vec![trans("initial", "idle", &[]), go, trans("fork", "on", &[]), trans("on", "initial", &["e_again"])];
        Statechart::new(root)
    }
}
