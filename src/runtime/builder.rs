//! The declaration of a component type, and the making of components, by one and the same constructor.
//!
//! [`Component::new`] runs in one of two ways: once *describing* (the builder notes every word), then *making* one
//! component each time (the builder only hands out ports and properties; docs, units and limits cost nothing).

use super::beat::Beat;
use super::call::Reply;
use super::component::{Arguments, Component, Context, HookResult, OperationAnswer, Returned};
use super::port::{EventIn, EventOut, In, InEnd, Out, OutEnd};
use super::probe::{Observed, Probes, ProbesEnd};
use super::property::{Prop, PropEnd};
use super::value::PortValue;
use crate::model::finding::count;
use crate::model::monitor::Condition;
use crate::model::{
    ComponentType, Direction, Effect, EventName, GENERIC_INJECTIONS, Ident, InjectionParameter, InjectionType,
    OperationType, PortType, PropertyType, Transition, Tunable, Value, ValueType,
};
use std::sync::Arc;

/// A port's end at the configurator.
pub(crate) enum PortEnd {
    In(Box<dyn InEnd>),
    Out(Box<dyn OutEnd>),
}

pub(crate) type HookFn<C> = fn(&mut C, &mut Context) -> HookResult;
pub(crate) type OperationFn<C> = Box<dyn Fn(&mut C, &mut Context, &[Value]) -> Option<Reply> + Send + Sync>;
/// An operation that runs in the caller's thread, beside the component's updates.
pub(crate) type CallerFn = Arc<dyn Fn(&[Value]) -> Reply + Send + Sync>;

/// What all components of a type share, in terms of their Rust type.
pub(crate) struct MemberTable<C> {
    /// Ports in the order of declaration, with the index in the order of names.
    ports: Vec<(Ident, usize)>,
    properties: Vec<(Ident, usize)>,
    /// In the order of names; none: runs in the caller's thread.
    pub(crate) operations: Vec<Option<OperationFn<C>>>,
    /// In the order of names.
    pub(crate) injections: Vec<OperationFn<C>>,
    pub(crate) hooks: [Option<HookFn<C>>; 4],
}

pub(crate) fn hook_index(transition: Transition) -> usize {
    match transition {
        Transition::Configure => 0,
        Transition::Start => 1,
        Transition::Stop => 2,
        Transition::Cleanup => 3,
    }
}

/// Declares a component's members. Words about one come before it: `b.doc("Force on the tool.").unit("N").input("f")`.
pub struct Builder<C> {
    pub(super) mode: BuilderMode<C>,
}

pub(super) enum BuilderMode<C> {
    Describe(Box<Description<C>>),
    Make(MakingMembers<C>),
}

pub(super) struct Description<C> {
    ty: ComponentType,
    words: MemberWords,
    ports: Vec<Ident>,
    properties: Vec<Ident>,
    operations: Vec<(Ident, Option<OperationFn<C>>)>,
    injections: Vec<(Ident, OperationFn<C>)>,
    hooks: [Option<HookFn<C>>; 4],
}

#[derive(Default)]
pub(super) struct MemberWords {
    pub(super) doc: String,
    pub(super) unit: Option<Arc<str>>,
    pub(super) min: Option<f64>,
    pub(super) max: Option<f64>,
    pub(super) tunable: Tunable,
    pub(super) raises: bool,
    pub(super) buffered: bool,
    pub(super) required: bool,
    pub(super) effect: Option<Effect>,
    pub(super) moves: bool,
    pub(super) settled_by: Option<Condition>,
    pub(super) parameters: Vec<InjectionParameter>,
}

pub(super) struct MakingMembers<C> {
    table: Arc<MemberTable<C>>,
    beat: Arc<Beat>,
    values: Vec<Value>,
    made: Ends,
    next_port: usize,
    next_property: usize,
    error: Option<String>,
}

/// The configurator's ends of one component's members, in the order of names.
pub(crate) struct Ends {
    pub(crate) ports: Vec<Option<PortEnd>>,
    pub(crate) properties: Vec<Option<Box<dyn PropEnd>>>,
    pub(crate) callers: Vec<(Ident, CallerFn)>,
    pub(crate) probes: Option<ProbesEnd>,
}

pub(super) fn ident(name: &str) -> Ident {
    Ident::new(name).expect("the name of a member")
}

impl<C: Component> Builder<C> {
    /// The type as its constructor declares it.
    pub(crate) fn describe_type(name: &str, new: impl FnOnce(&mut Self) -> C) -> (ComponentType, MemberTable<C>) {
        let description = Description {
            ty: ComponentType::new(name, ""),
            words: MemberWords::default(),
            ports: Vec::new(),
            properties: Vec::new(),
            operations: Vec::new(),
            injections: Vec::new(),
            hooks: [None; 4],
        };
        let mut builder = Self { mode: BuilderMode::Describe(Box::new(description)) };
        drop(new(&mut builder));
        let BuilderMode::Describe(mut d) = builder.mode else { unreachable!("the mode never changes") };
        let ports: Vec<Ident> = d.ty.ports.keys().copied().collect();
        let properties: Vec<Ident> = d.ty.properties.keys().copied().collect();
        let indexed = |order: &[Ident], sorted: &[Ident]| {
            order.iter().map(|n| (*n, sorted.binary_search(n).expect("declared"))).collect::<Vec<_>>()
        };
        d.operations.sort_by_key(|(name, _)| *name);
        d.injections.sort_by_key(|(name, _)| *name);
        for operation in d.ty.operations.values() {
            if let Effect::Undo(undo) = &operation.effect {
                assert!(d.ty.operations.contains_key(undo), "{name}: there is no operation `{undo}` to undo another");
            }
        }
        let table = MemberTable {
            ports: indexed(&d.ports, &ports),
            properties: indexed(&d.properties, &properties),
            operations: d.operations.into_iter().map(|(_, f)| f).collect(),
            injections: d.injections.into_iter().map(|(_, f)| f).collect(),
            hooks: d.hooks,
        };
        (d.ty, table)
    }

    /// One component, with these property values (in the order of names).
    ///
    /// # Errors
    /// In words, when a value does not fit its property's Rust type.
    pub(crate) fn make(
        table: &Arc<MemberTable<C>>,
        beat: &Arc<Beat>,
        values: Vec<Value>,
        new: impl FnOnce(&mut Self) -> C,
    ) -> Result<(C, Ends, Vec<Value>), String> {
        let mut ports = Vec::with_capacity(table.ports.len());
        ports.resize_with(table.ports.len(), || None);
        let mut properties = Vec::with_capacity(table.properties.len());
        properties.resize_with(table.properties.len(), || None);
        let made = Ends { ports, properties, callers: Vec::new(), probes: None };
        if values.len() != table.properties.len() {
            return Err(format!("{} for {}", count(values.len(), "value"), count(table.properties.len(), "property")));
        }
        let making = MakingMembers {
            table: table.clone(),
            beat: beat.clone(),
            values,
            made,
            next_port: 0,
            next_property: 0,
            error: None,
        };
        let mut builder = Self { mode: BuilderMode::Make(making) };
        let component = new(&mut builder);
        let BuilderMode::Make(making) = builder.mode else { unreachable!("the mode never changes") };
        match making.error {
            Some(error) => Err(error),
            None => Ok((component, making.made, making.values)),
        }
    }

    pub(super) fn words(&mut self, f: impl FnOnce(&mut MemberWords)) -> &mut Self {
        if let BuilderMode::Describe(d) = &mut self.mode {
            f(&mut d.words);
        }
        self
    }

    pub(super) fn ty(&mut self, f: impl FnOnce(&mut ComponentType)) -> &mut Self {
        if let BuilderMode::Describe(d) = &mut self.mode {
            f(&mut d.ty);
        }
        self
    }

    // ---- hooks -------------------------------------------------------------------------------------------------

    /// What configuring means: opening a device, reading a file. Runs on a worker, while the component is not running,
    /// under a deadline. Without it configuring is immediate. All four hooks alike.
    pub fn on_configure(&mut self, hook: HookFn<C>) -> &mut Self {
        self.hook(Transition::Configure, hook)
    }

    /// What starting means; it runs before the first update.
    pub fn on_start(&mut self, hook: HookFn<C>) -> &mut Self {
        self.hook(Transition::Start, hook)
    }

    /// What stopping means; it runs after the last update has ended. When it fails the component runs on.
    pub fn on_stop(&mut self, hook: HookFn<C>) -> &mut Self {
        self.hook(Transition::Stop, hook)
    }

    /// What cleaning up means: closing what configuring opened.
    pub fn on_cleanup(&mut self, hook: HookFn<C>) -> &mut Self {
        self.hook(Transition::Cleanup, hook)
    }

    fn hook(&mut self, transition: Transition, hook: HookFn<C>) -> &mut Self {
        if let BuilderMode::Describe(d) = &mut self.mode {
            d.hooks[hook_index(transition)] = Some(hook);
        }
        self
    }

    // ---- members -----------------------------------------------------------------------------------------------

    /// An in-port.
    pub fn input<T: PortValue>(&mut self, name: &str) -> In<T> {
        match &mut self.mode {
            BuilderMode::Describe(d) => {
                d.port(name, Direction::In, T::value_type());
                In::loose()
            }
            BuilderMode::Make(m) => {
                let (port, end) = In::new(&m.beat);
                m.put_port(name, PortEnd::In(end));
                port
            }
        }
    }

    /// An out-port.
    pub fn output<T: PortValue>(&mut self, name: &str) -> Out<T> {
        match &mut self.mode {
            BuilderMode::Describe(d) => {
                d.port(name, Direction::Out, T::value_type());
                Out::loose()
            }
            BuilderMode::Make(m) => {
                let (port, end) = Out::new(&m.beat);
                m.put_port(name, PortEnd::Out(end));
                port
            }
        }
    }

    /// An in-port for events: a queue.
    pub fn event_input(&mut self, name: &str) -> EventIn {
        self.input(name)
    }

    /// An out-port for events.
    pub fn event_output(&mut self, name: &str) -> EventOut {
        EventOut::over(self.output(name))
    }

    /// A property with a default.
    pub fn property<T: PortValue>(&mut self, name: &str, default: T) -> Prop<T> {
        self.any_property(name, default, true)
    }

    /// A property that must be given when the component is created. `stand_in` is never anybody's value: it is what the
    /// component has while its type is described.
    pub fn required_property<T: PortValue>(&mut self, name: &str, stand_in: T) -> Prop<T> {
        self.any_property(name, stand_in, false)
    }

    fn any_property<T: PortValue>(&mut self, name: &str, value: T, is_default: bool) -> Prop<T> {
        match &mut self.mode {
            BuilderMode::Describe(d) => {
                d.property(name, is_default.then(|| value.to_value()), T::value_type(), T::limits());
                Prop::loose(value)
            }
            BuilderMode::Make(m) => {
                let (index, given) = m.next_value(name);
                let fitting = given.and_then(T::from_value);
                if fitting.is_none() {
                    m.error = Some(format!("the value given for `{name}` does not fit"));
                }
                let (property, end) = Prop::new(fitting.unwrap_or(value));
                m.made.properties[index] = Some(end);
                property
            }
        }
    }

    /// An operation, run in the component's own activity between two updates (on a worker while it is not running). One that
    /// takes long looks at [`Context::is_cancelled`], or at its ticket's, and comes to rest when it is given up.
    ///
    /// The function is the type's, not the component's: it gets the component as its first argument.
    pub fn operation<A: Arguments, R: Returned>(
        &mut self,
        name: &str,
        f: impl Fn(&mut C, &mut Context, A) -> OperationAnswer<R> + Send + Sync + 'static,
    ) -> &mut Self {
        if let BuilderMode::Describe(d) = &mut self.mode {
            let erased: OperationFn<C> = Box::new(move |component, cx, args| {
                let Some(args) = A::from_values(args) else {
                    return Some(Reply::Refused("an argument does not fit".to_owned()));
                };
                match f(component, cx, args) {
                    OperationAnswer::Done(value) => Some(Reply::Done(value.into_value())),
                    OperationAnswer::Failed(text) => Some(Reply::Failed(text)),
                    OperationAnswer::Pending => None,
                }
            });
            d.operation(name, A::types(), R::value_type(), Some(erased));
        }
        self
    }

    /// An operation that runs in the caller's thread, also while the component is updated: it answers for its own
    /// synchronisation, and so gets nothing but what it captures. It never answers [`OperationAnswer::Pending`], and is not told when
    /// it is given up: it should be short. A brake is written so: called from a `safe` configuration it waits for nothing
    /// that the component does, not even in quarantine.
    pub fn caller_operation<A: Arguments, R: Returned>(
        &mut self,
        name: &str,
        f: impl Fn(A) -> OperationAnswer<R> + Send + Sync + 'static,
    ) -> &mut Self {
        match &mut self.mode {
            BuilderMode::Describe(d) => d.operation(name, A::types(), R::value_type(), None),
            BuilderMode::Make(m) => {
                let erased: CallerFn = Arc::new(move |args| match A::from_values(args).map(&f) {
                    None => Reply::Refused("an argument does not fit".to_owned()),
                    Some(OperationAnswer::Done(value)) => Reply::Done(value.into_value()),
                    Some(OperationAnswer::Failed(text)) => Reply::Failed(text),
                    Some(OperationAnswer::Pending) => Reply::Failed("it cannot answer later".to_owned()),
                });
                m.made.callers.push((ident(name), erased));
            }
        }
        self
    }

    /// Probes of what is `wanted`, beside connections. They come and go with what they look at; a component has one set.
    pub fn probes(&mut self, wanted: Arc<[Observed]>) -> Probes {
        match &mut self.mode {
            BuilderMode::Describe(_) => Probes::loose(),
            BuilderMode::Make(m) => {
                let (probes, end) = Probes::new(wanted, &m.beat);
                m.made.probes = Some(end);
                probes
            }
        }
    }

    /// An event that a component of the type may raise, on an [`event_output`](Self::event_output). What [`doc`](Self::doc) says before is
    /// what the event tells. `davit types` shows it, and `davit check` knows by it what a coordinator was meant to wait for.
    ///
    /// # Panics
    /// When `name` is no event name.
    pub fn event(&mut self, name: &str) -> EventName {
        let event = EventName::new(name).expect("an event's name");
        if let BuilderMode::Describe(d) = &mut self.mode {
            let (told, doc) = (d.ty.raises.entry(event).or_default(), std::mem::take(&mut d.words).doc);
            // In two places of the code it is one event all the same.
            if !doc.is_empty() {
                *told = doc;
            }
        }
        event
    }
}

impl<C> Description<C> {
    pub(super) fn injection(&mut self, name: &str, types: &[ValueType], f: OperationFn<C>) {
        let words = std::mem::take(&mut self.words);
        let (name, of) = (ident(name), &self.ty.name);
        let generic = GENERIC_INJECTIONS.iter().any(|(generic, ..)| *generic == name.as_str());
        assert!(!generic, "{of}: every component has the injection `{name}`");
        let declared = words.parameters.iter().map(|parameter| &parameter.ty);
        assert!(declared.eq(types), "{of}: the parameters of `{name}` are not what its function takes");
        let injection = InjectionType { parameters: words.parameters, doc: words.doc };
        assert!(self.ty.injections.insert(name, injection).is_none(), "{of}: `{name}` is declared twice");
        self.injections.push((name, f));
    }

    fn port(&mut self, name: &str, direction: Direction, ty: ValueType) {
        let words = std::mem::take(&mut self.words);
        let name = ident(name);
        let MemberWords { unit, buffered, required, doc, .. } = words;
        let port = PortType { unit, buffered, required, doc, ..PortType::new(direction, ty) };
        assert!(self.ty.ports.insert(name, port).is_none(), "{}: `{name}` is declared twice", self.ty.name);
        self.ports.push(name);
    }

    fn property(&mut self, name: &str, default: Option<Value>, ty: ValueType, limits: Option<(f64, f64)>) {
        let words = std::mem::take(&mut self.words);
        let name = ident(name);
        let (min, max) = limits.unzip();
        let (min, max) = (words.min.or(min), words.max.or(max));
        let MemberWords { raises, unit, doc, .. } = words;
        assert!(!raises || ty == ValueType::Str, "{}: `{name}` names an event, and is no text", self.ty.name);
        let mut property = PropertyType { min, max, raises, unit, doc, ..PropertyType::new(ty, words.tunable) };
        property.default = default.map(|value| match property.fit(value) {
            Ok(value) => value,
            Err(error) => panic!("{}: the default of `{name}`: {error}", self.ty.name),
        });
        assert!(self.ty.properties.insert(name, property).is_none(), "{}: `{name}` is declared twice", self.ty.name);
        self.properties.push(name);
    }

    fn operation(&mut self, name: &str, args: Vec<ValueType>, returns: Option<ValueType>, f: Option<OperationFn<C>>) {
        let words = std::mem::take(&mut self.words);
        let name = ident(name);
        let effect = words.effect.unwrap_or(Effect::Irreversible);
        let (moves, settled_by) = (words.moves, words.settled_by);
        let operation =
            OperationType { args, returns, moves, settled_by, doc: words.doc, ..OperationType::new(effect) };
        assert!(self.ty.operations.insert(name, operation).is_none(), "{}: `{name}` is declared twice", self.ty.name);
        self.operations.push((name, f));
    }
}

impl<C> MakingMembers<C> {
    fn put_port(&mut self, name: &str, end: PortEnd) {
        let (declared, index) = self.table.ports.get(self.next_port).copied().unwrap_or_else(|| undeclared(name));
        assert!(declared.as_str() == name, "declared `{name}` where the type has `{declared}`");
        self.next_port += 1;
        self.made.ports[index] = Some(end);
    }

    fn next_value(&mut self, name: &str) -> (usize, Option<&Value>) {
        let next = self.table.properties.get(self.next_property).copied();
        let (declared, index) = next.unwrap_or_else(|| undeclared(name));
        assert!(declared.as_str() == name, "declared `{name}` where the type has `{declared}`");
        self.next_property += 1;
        (index, self.values.get(index))
    }
}

fn undeclared(name: &str) -> ! {
    panic!("declared `{name}`, which was not declared when the type was described")
}
