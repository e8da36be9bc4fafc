//! Libraries: named sets of component types. A catalogue starts nothing.

use super::beat::Beat;
use super::builder::{Builder, Ends, MemberTable, hook_index};
use super::call::Reply;
use super::component::{Component, Context, HookResult};
use crate::model::{Catalogue, ComponentType, Ident, Transition, TypeName, Value};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// A component, without its Rust type.
pub(crate) trait Body: Send {
    fn update(&mut self, cx: &mut Context);
    fn hook(&mut self, transition: Transition, cx: &mut Context) -> HookResult;
    /// Calls the operation of that index; none: it will answer by its ticket.
    fn operation(&mut self, index: usize, args: &[Value], cx: &mut Context) -> Option<Reply>;
    /// Has the injection of that index happen.
    fn inject(&mut self, index: usize, values: &[Value], cx: &mut Context) -> Option<Reply>;
}

struct Typed<C> {
    component: C,
    table: Arc<MemberTable<C>>,
}

impl<C: Component> Body for Typed<C> {
    fn update(&mut self, cx: &mut Context) {
        self.component.update(cx);
    }

    fn hook(&mut self, transition: Transition, cx: &mut Context) -> HookResult {
        match self.table.hooks[hook_index(transition)] {
            Some(hook) => hook(&mut self.component, cx),
            None => Ok(()),
        }
    }

    fn operation(&mut self, index: usize, args: &[Value], cx: &mut Context) -> Option<Reply> {
        match self.table.operations.get(index) {
            Some(Some(f)) => f(&mut self.component, cx, args),
            _ => Some(Reply::Refused("there is no such operation here".to_owned())),
        }
    }

    fn inject(&mut self, index: usize, values: &[Value], cx: &mut Context) -> Option<Reply> {
        match self.table.injections.get(index) {
            Some(f) => f(&mut self.component, cx, values),
            None => Some(Reply::Refused("there is no such injection here".to_owned())),
        }
    }
}

/// A component with the configurator's ends of its members and the values of its properties.
pub(crate) struct MadeComponent {
    pub(crate) body: Box<dyn Body>,
    pub(crate) ends: Ends,
    pub(crate) values: Vec<Value>,
}

type Maker = Box<dyn Fn(&Arc<Beat>, Vec<Value>) -> Result<MadeComponent, String> + Send + Sync>;

/// A component type that this program can make.
pub struct ComponentFactory {
    /// Its description.
    pub ty: Arc<ComponentType>,
    /// Which transitions call the component's own code; the others are immediate.
    hooks: [bool; 4],
    /// Whether making and dropping one is promised to be immediate.
    immediate: bool,
    /// Ports and properties by name, in the order of the ends.
    pub(crate) ports: Vec<Ident>,
    pub(crate) properties: Vec<Ident>,
    pub(crate) operations: Vec<Ident>,
    make: Maker,
}

impl std::fmt::Debug for ComponentFactory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Kind({})", self.ty.name)
    }
}

impl ComponentFactory {
    /// The type that `C` declares, under a name.
    ///
    /// # Panics
    /// When the declaration is wrong: a name that is none, a member twice, a default outside its own limits. A library
    /// is written by a programmer and described at every start of the program.
    pub fn of<C: Component>(name: &str) -> Self {
        Self::made_by(name, C::new)
    }

    /// The type that `new` declares and makes, under a name: for types that depend on more than their Rust type. It must
    /// declare the same members each time.
    ///
    /// # Panics
    /// As [`ComponentFactory::of`].
    pub fn made_by<C: Component>(name: &str, new: impl Fn(&mut Builder<C>) -> C + Send + Sync + 'static) -> Self {
        let (ty, table) = Builder::<C>::describe_type(name, &new);
        let table = Arc::new(table);
        let hooks = table.hooks.map(|hook| hook.is_some());
        let (ports, properties) = (ty.ports.keys().copied().collect(), ty.properties.keys().copied().collect());
        let operations = ty.operations.keys().copied().collect();
        let make: Maker = Box::new(move |beat, values| {
            let (component, ends, values) = Builder::make(&table, beat, values, &new)?;
            Ok(MadeComponent { body: Box::new(Typed { component, table: table.clone() }), ends, values })
        });
        Self { ty: Arc::new(ty), hooks, immediate: false, ports, properties, operations, make }
    }

    /// Promises that making a component of this type, and dropping one, is wait-free and bounded: its `new` does nothing
    /// but declare, and no `Drop` of its own or of what it holds waits for anything. It is then done in the configurator's
    /// own thread; without the promise on a worker under a deadline, which costs the more the more components there are.
    #[must_use]
    pub fn immediate(self) -> Self {
        Self { immediate: true, ..self }
    }

    /// Whether [`ComponentFactory::immediate`] was promised.
    pub fn is_immediate(&self) -> bool {
        self.immediate
    }

    /// Whether the transition calls the component's own code.
    pub fn has_hook(&self, transition: Transition) -> bool {
        self.hooks[hook_index(transition)]
    }

    /// Whether any transition does.
    pub fn has_hooks(&self) -> bool {
        self.hooks.contains(&true)
    }

    pub(crate) fn make(&self, beat: &Arc<Beat>, values: Vec<Value>) -> Result<MadeComponent, String> {
        (self.make)(beat, values)
    }
}

/// A named set of component types.
#[derive(Debug, Clone)]
pub struct Library {
    name: Ident,
    kinds: Vec<Arc<ComponentFactory>>,
}

impl Library {
    /// An empty library.
    ///
    /// # Panics
    /// When `name` is no plain name.
    pub fn new(name: &str) -> Self {
        Self { name: Ident::new(name).expect("a library's name"), kinds: Vec::new() }
    }

    /// With the component type `C`, under the name that deployments use: `Gain`, `youbot.Dynamics`.
    ///
    /// # Panics
    /// When the declaration is wrong: a name that is none, a member twice, a default outside its own limits.
    #[must_use]
    pub fn with<C: Component>(mut self, type_name: &str) -> Self {
        self.kinds.push(Arc::new(ComponentFactory::of::<C>(type_name)));
        self
    }

    /// As [`Library::with`], with the promise that `C` does nothing but declare when it is made, and waits for nothing when it
    /// is dropped: both are then done without a worker.
    ///
    /// # Panics
    /// When the declaration is wrong: a name that is none, a member twice, a default outside its own limits.
    #[must_use]
    pub fn with_immediate<C: Component>(self, type_name: &str) -> Self {
        self.with_kind(ComponentFactory::of::<C>(type_name).immediate())
    }

    /// With a component type that was made before.
    #[must_use]
    pub fn with_kind(mut self, kind: ComponentFactory) -> Self {
        self.kinds.push(Arc::new(kind));
        self
    }

    /// Its name.
    pub fn name(&self) -> Ident {
        self.name
    }

    /// Its types.
    pub fn kinds(&self) -> &[Arc<ComponentFactory>] {
        &self.kinds
    }

    /// Its types' descriptions.
    pub fn catalogue(&self) -> Catalogue {
        let mut catalogue = Catalogue::new();
        for kind in &self.kinds {
            catalogue.insert(kind.ty.clone());
        }
        catalogue
    }
}

/// The libraries a program has built in.
#[derive(Debug, Clone, Default)]
pub struct Libraries(Vec<Library>);

impl Libraries {
    /// None.
    pub fn new() -> Self {
        Self::default()
    }

    /// With one more; a later library's type replaces an earlier one's of the same name, a later library an earlier one
    /// of the same name.
    #[must_use]
    pub fn with(mut self, library: Library) -> Self {
        self.0.retain(|other| other.name != library.name);
        self.0.push(library);
        self
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Library> {
        self.0.iter()
    }

    /// The library of that name.
    pub fn get(&self, name: Ident) -> Option<&Library> {
        self.0.iter().find(|library| library.name == name)
    }

    /// Only those named, in this order.
    ///
    /// # Errors
    /// The first name that is none of a library.
    pub fn select(&self, names: &[Ident]) -> Result<Self, Ident> {
        names.iter().map(|name| self.get(*name).cloned().ok_or(*name)).collect::<Result<Vec<_>, _>>().map(Self)
    }

    /// All types' descriptions.
    pub fn catalogue(&self) -> Catalogue {
        let mut catalogue = Catalogue::new();
        for library in &self.0 {
            catalogue.extend(&library.catalogue());
        }
        catalogue
    }

    /// All types by name.
    pub(crate) fn kinds(&self) -> FxHashMap<TypeName, Arc<ComponentFactory>> {
        self.0.iter().flat_map(|library| &library.kinds).map(|kind| (kind.ty.name, kind.clone())).collect()
    }
}
