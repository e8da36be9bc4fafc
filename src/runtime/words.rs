//! The words of a declaration: what is said about a component type, and about the member that comes next.

use super::builder::{Builder, BuilderMode, OperationFn, ident};
use super::call::Reply;
use super::component::{Arguments, Component, Context, HookResult};
use super::value::PortValue;
use crate::model::monitor::Condition;
use crate::model::{Effect, InjectionParameter, Irreversible, Resource, Tunable, TypeName};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Words about the type.
impl<C: Component> Builder<C> {
    /// What the type is for; `davit types` prints it.
    pub fn describe(&mut self, doc: &str) -> &mut Self {
        self.ty(|ty| ty.doc = doc.to_owned())
    }

    /// It moves something.
    pub fn actuator(&mut self) -> &mut Self {
        self.ty(|ty| ty.actuator = true)
    }

    /// Starting one moves hardware: an automatic rollback does not do it unasked.
    pub fn moves_on_start(&mut self) -> &mut Self {
        self.ty(|ty| ty.moves.start = true)
    }

    /// Stopping one moves hardware.
    pub fn moves_on_stop(&mut self) -> &mut Self {
        self.ty(|ty| ty.moves.stop = true)
    }

    /// Components of type `other` start before those of this type.
    ///
    /// # Panics
    /// When `other` is no type name.
    pub fn start_after(&mut self, other: &str) -> &mut Self {
        self.ty(|ty| ty.start_after.push(TypeName::new(other).expect("a component type's name")))
    }

    /// Components of type `other` stop after those of this type.
    ///
    /// # Panics
    /// When `other` is no type name.
    pub fn stop_before(&mut self, other: &str) -> &mut Self {
        self.ty(|ty| ty.stop_before.push(TypeName::new(other).expect("a component type's name")))
    }

    /// What a component needs for itself from *configured* on: a name in which `{property}` is the value of a property that is
    /// tunable only while *unconfigured*.
    ///
    /// # Panics
    /// When it is no such name.
    pub fn exclusive(&mut self, resource: &str) -> &mut Self {
        self.ty(|ty| ty.exclusive.push(Resource::parse(resource).expect("the name of what it needs")))
    }

    /// Which moves of its run state cannot be undone.
    pub fn irreversible(&mut self, what: Irreversible) -> &mut Self {
        self.ty(|ty| ty.irreversible = what)
    }
}

/// Words about the next member.
impl<C: Component> Builder<C> {
    /// What the member is.
    pub fn doc(&mut self, doc: &str) -> &mut Self {
        self.words(|w| w.doc = doc.to_owned())
    }

    /// The unit of a port or property.
    pub fn unit(&mut self, unit: &str) -> &mut Self {
        self.words(|w| w.unit = Some(Arc::from(unit)))
    }

    /// The smallest and largest value of a property, of every number in it.
    pub fn range(&mut self, range: RangeInclusive<f64>) -> &mut Self {
        self.words(|w| (w.min, w.max) = (Some(*range.start()), Some(*range.end())))
    }

    /// The smallest value of a property.
    pub fn min(&mut self, min: f64) -> &mut Self {
        self.words(|w| w.min = Some(min))
    }

    /// The largest value of a property.
    pub fn max(&mut self, max: f64) -> &mut Self {
        self.words(|w| w.max = Some(max))
    }

    /// When a property may be set.
    pub fn tunable(&mut self, tunable: Tunable) -> &mut Self {
        self.words(|w| w.tunable = tunable)
    }

    /// The value of a property, a text, is the name of an event that the component raises; empty: none. `davit check` then warns of one that
    /// nobody listens to.
    pub fn raises(&mut self) -> &mut Self {
        self.words(|w| w.raises = true)
    }

    /// The in-port is read as a queue: it takes only buffered connections, any number of them.
    pub fn buffered(&mut self) -> &mut Self {
        self.words(|w| w.buffered = true)
    }

    /// Something has to drive the in-port: where no configuration connects or writes it, `davit check` warns.
    pub fn required(&mut self) -> &mut Self {
        self.words(|w| w.required = true)
    }

    /// The operation leaves nothing behind that would have to be undone.
    pub fn no_effect(&mut self) -> &mut Self {
        self.words(|w| w.effect = Some(Effect::None))
    }

    /// The operation is undone by another one of the same component.
    pub fn undone_by(&mut self, operation: &str) -> &mut Self {
        self.words(|w| w.effect = Some(Effect::Undo(ident(operation))))
    }

    /// Calling the operation moves hardware: an automatic rollback does not do it unasked.
    pub fn moves(&mut self) -> &mut Self {
        self.words(|w| w.moves = true)
    }

    /// A parameter of the injection that comes next, which takes them in this order; without a default it must be given. Unit and limits that
    /// were said before it are its own.
    pub fn parameter<T: PortValue>(&mut self, name: &str, default: Option<T>) -> &mut Self {
        let name = ident(name);
        let default = default.map(|value| value.to_value());
        self.words(|w| {
            let (min, max, unit) = (w.min.take(), w.max.take(), w.unit.take());
            w.parameters.push(InjectionParameter { name, ty: T::value_type(), default, min, max, unit });
        })
    }

    /// Something that can be made to go wrong in the component, at any moment, in the middle of an operation too: a fault of
    /// the hardware behind it. A scenario asks for it by name, `inject("drive", "overcurrent", { joint = 2 })`, with a value for each
    /// [parameter](Self::parameter); `davit types` shows it. It happens in the component's own activity between two updates, on a
    /// worker while it does not run. What it answers says whether it could be made to happen.
    ///
    /// ```
    /// # use davit::component::{Builder, Component, Failure};
    /// struct Drive { hot: [bool; 3] }
    ///
    /// impl Component for Drive {
    ///     fn new(b: &mut Builder<Self>) -> Self {
    ///         b.doc("A motor is too hot.").parameter("joint", Some(0_usize)).injection("overtemp", |c, _, (joint,): (usize,)| {
    ///             *c.hot.get_mut(joint).ok_or(Failure("there are joints 0 to 2".to_owned()))? = true;
    ///             Ok(())
    ///         });
    ///         Self { hot: [false; 3] }
    ///     }
    /// }
    /// # assert_eq!(davit::component::Library::new("mine").with::<Drive>("Drive").catalogue().iter().next().unwrap().injections.len(), 1);
    /// ```
    ///
    /// # Panics
    /// When the parameters declared before it are not of the types that the function takes.
    pub fn injection<A: Arguments>(
        &mut self,
        name: &str,
        f: impl Fn(&mut C, &mut Context, A) -> HookResult + Send + Sync + 'static,
    ) -> &mut Self {
        if let BuilderMode::Describe(d) = &mut self.mode {
            let erased: OperationFn<C> = Box::new(move |component, cx, values| {
                let Some(values) = A::from_values(values) else {
                    return Some(Reply::Refused("a parameter does not fit".to_owned()));
                };
                Some(f(component, cx, values).map_or_else(|why| Reply::Failed(why.0), |()| Reply::Done(None)))
            });
            d.injection(name, &A::types(), erased);
        }
        self
    }

    /// What is true of the component once the operation was done: a call of which no answer came is settled by it. The
    /// component itself is written `self`: `Condition::compare("self.mode", Comparison::Equals, 6.0)`.
    pub fn settled_by(&mut self, condition: Condition) -> &mut Self {
        self.words(|w| w.settled_by = Some(condition))
    }
}
