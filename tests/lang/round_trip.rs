//! The text law: parse(print(m)) = m, in Lua and in YAML, over generated models. `DAVIT_LAW_CASES` sets how many.

use crate::helpers::shown;
use davit::diagnostics::Language;
use davit::lang::{self, LoadOptions, Sources, print};
use davit::model::monitor::*;
use davit::model::statechart::{
    Action, ChartNode, ChartTransition as DiagramEdge, Connector, Since, State, Statechart, Trigger,
};
use davit::model::*;
use proptest::collection::{btree_map, btree_set, vec};
use proptest::option;
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

fn cases() -> ProptestConfig {
    let cases = std::env::var("DAVIT_LAW_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// Names: ordinary ones, words of Lua and of YAML.
fn ident() -> impl Strategy<Value = Ident> {
    prop_oneof![
        4 => "[A-Za-z_][A-Za-z0-9_]{0,6}",
        1 => prop::sample::select(vec!["end", "nil", "true", "null", "yes", "no", "on", "n", "repeat", "_", "inf", "e1"]).prop_map(str::to_owned),
    ]
    .prop_map(|text| Ident::new(&text).unwrap())
}

fn component() -> impl Strategy<Value = ComponentName> {
    vec(ident(), 1..3).prop_map(|parts| {
        let parts: Vec<_> = parts.iter().map(Ident::as_str).collect();
        ComponentName::new(&parts.join("/")).unwrap()
    })
}

fn type_name() -> impl Strategy<Value = TypeName> {
    vec(ident(), 1..3).prop_map(|parts| {
        let parts: Vec<_> = parts.iter().map(Ident::as_str).collect();
        TypeName::new(&parts.join(".")).unwrap()
    })
}

fn member() -> impl Strategy<Value = MemberRef> {
    (component(), ident()).prop_map(|(component, member)| component.member(member))
}

fn event() -> impl Strategy<Value = EventName> {
    prop_oneof![
        3 => "e_[a-z0-9]{1,5}",
        1 => "[a-zA-Z:#@.'\"{}\\[\\],&*!|>%`é-]{1,8}",
    ]
    .prop_filter_map("an event", |text| EventName::new(&text).ok().filter(|e| !e.as_str().contains("e_a")))
}

/// Texts with everything in them: quotes, escapes, controls, line ends, wide characters.
fn any_text() -> impl Strategy<Value = String> {
    prop_oneof![
        3 => "[ -~]{0,12}",
        2 => vec(any::<char>(), 0..8).prop_map(|chars| chars.into_iter().collect::<String>()),
        1 => prop::sample::select(vec!["", " ", "true", "1", "1.0", "~", "0x1", "null", "- a", "a: b", "# c", "\n", "\r\n", "\0", "\u{85}", "\u{2028}", "\u{feff}", "]]", "\\n", "\t x", "1e3", ".nan", "é\u{1}9"]).prop_map(str::to_owned),
        1 => (1_usize..3000).prop_map(|n| "long \"text\" ".repeat(n / 12)),
    ]
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>().prop_filter("finite", |v| v.is_finite()),
        (-1000_i32..1000).prop_map(f64::from),
        prop::sample::select(vec![0.0, -0.0, 0.1, 1e300, -1e-300, f64::MAX, f64::MIN_POSITIVE, 5e-324]),
    ]
}

fn value() -> impl Strategy<Value = Value> {
    let leaf = prop_oneof![
        any::<bool>().prop_map(Value::Bool),
        any::<i64>().prop_map(Value::Int),
        prop::sample::select(vec![i64::MIN, i64::MAX, 0, -1]).prop_map(Value::Int),
        finite().prop_map(Value::Float),
        any_text().prop_map(|text| Value::str(&text)),
    ];
    leaf.prop_recursive(3, 16, 4, |inner| {
        prop_oneof![
            vec(inner.clone(), 0..4).prop_map(Value::Array),
            btree_map(ident(), inner, 1..4).prop_map(|fields| Value::Record(fields.into_iter().collect())),
        ]
    })
}

fn time() -> impl Strategy<Value = Duration> {
    prop_oneof![1_u64..86_400_000_000_000, prop::sample::select(vec![1, 500_000_000, 1_000_000_000])]
        .prop_map(Duration::from_nanos)
}

fn call() -> impl Strategy<Value = Call> {
    (member(), vec(value(), 0..3)).prop_map(|(operation, args)| Call { operation, args })
}

fn change() -> impl Strategy<Value = Change> {
    let policy = prop_oneof![Just(Policy::Data), (1_u32..1_000_000).prop_map(Policy::Buffer)];
    prop_oneof![
        (component(), type_name(), option::of(ident()), btree_map(ident(), value(), 0..3)).prop_map(
            |(component, ty, activity, properties)| ChangeKind::Create { component, ty, activity, properties }
        ),
        component().prop_map(|component| ChangeKind::Destroy { component }),
        (
            component(),
            type_name(),
            option::of(ident()),
            btree_map(ident(), value(), 0..3),
            btree_map(ident(), ident(), 0..3)
        )
            .prop_map(|(component, ty, activity, properties, map)| ChangeKind::Replace {
                component,
                ty,
                activity,
                properties,
                map
            }),
        (member(), member(), policy).prop_map(|(from, to, policy)| ChangeKind::Connect { from, to, policy }),
        (member(), member()).prop_map(|(from, to)| ChangeKind::Disconnect { from, to }),
        (member(), value()).prop_map(|(property, value)| ChangeKind::PropertySet { property, value }),
        (member(), value()).prop_map(|(port, value)| ChangeKind::PortWrite { port, value }),
        (call(), option::of(call())).prop_map(|(call, undo)| ChangeKind::OperationCall { call, undo }),
    ]
    .prop_map(|kind| Change { kind, origin: Origin::NONE })
}

fn states() -> impl Strategy<Value = StateList> {
    let state = prop::sample::select(vec![Wanted::Unconfigured, Wanted::Stopped, Wanted::Running]);
    let one = (component(), state.clone()).prop_filter_map("not the keyword", |(name, state)| {
        (name.as_str() != "_default").then_some((Target::Component(name), state))
    });
    (vec(one, 0..3), option::of((state, 0_usize..3))).prop_map(|(mut list, default)| {
        if let Some((state, place)) = default {
            list.insert(place.min(list.len()), (Target::Default, state));
        }
        StateList::of(list.into_iter().map(|(target, state)| StateEntry { target, state, origin: Origin::NONE }))
            .unwrap()
    })
}

fn config_id() -> impl Strategy<Value = ConfigId> {
    component().prop_map(|name| ConfigId::new(name.as_str()).unwrap())
}

/// What is written nowhere.
fn placed<T>(all: impl IntoIterator<Item = T>) -> Vec<(T, Origin)> {
    all.into_iter().map(|one| (one, Origin::NONE)).collect()
}

fn configuration() -> impl Strategy<Value = Configuration> {
    let id = config_id();
    let confirm = option::of((event(), time()).prop_map(|(event, within)| Confirm { event, within }));
    let on_failure = prop::sample::select(vec![OnFailure::Unset, OnFailure::Rollback, OnFailure::Hold]);
    let failing = (any::<bool>(), on_failure, confirm).prop_map(|(safe, on_failure, confirm)| {
        // What contradicts each other is refused.
        let on_failure = if safe { OnFailure::Unset } else { on_failure };
        (safe, on_failure, confirm.filter(|_| !safe && on_failure != OnFailure::Hold))
    });
    let holds = option::weighted(0.3, condition());
    let attributes = (option::of(time()), option::of(ident()), failing, holds, any::<bool>(), option::of(any_text()));
    (id, states(), vec(change(), 0..5), states(), attributes).prop_map(|(id, pre, changes, post, attributes)| {
        let (timeout, group, (safe, on_failure, confirm), holds, irreversible, description) = attributes;
        Configuration {
            pre,
            changes,
            post,
            timeout,
            group,
            safe,
            on_failure,
            holds,
            confirm,
            irreversible,
            description,
            ..Configuration::new(id)
        }
    })
}

fn configurations() -> impl Strategy<Value = Vec<Configuration>> {
    vec(configuration(), 0..4).prop_map(|mut list| {
        let mut seen = BTreeSet::new();
        list.retain(|c| seen.insert(c.id));
        list
    })
}

fn trigger() -> impl Strategy<Value = Trigger> {
    prop_oneof![
        3 => event().prop_map(Trigger::Event),
        1 => (any::<bool>(), 0.0..1e6_f64).prop_map(|(entry, s)| Trigger::timed(if entry { Since::Entry } else { Since::Start }, s)),
    ]
}

fn edge() -> impl Strategy<Value = DiagramEdge> {
    let reference =
        || option::weighted(0.9, "\\.?[a-z]{1,4}(\\.[a-z]{1,4}){0,2}".prop_map(|text| (text, Origin::NONE)));
    let names = || vec(event().prop_map(|e| (Action::Raise(e), Origin::NONE)), 0..3);
    let triggers = vec(trigger().prop_map(|t| (t, Origin::NONE)), 0..3);
    (reference(), reference(), triggers, names(), finite(), option::of(any_text())).prop_map(
        |(src, tgt, events, effect, pn, doc)| DiagramEdge {
            src,
            tgt,
            events,
            effect,
            pn,
            doc,
            ..DiagramEdge::default()
        },
    )
}

fn state() -> impl Strategy<Value = State> {
    let names = || vec(event().prop_map(|e| (Action::Raise(e), Origin::NONE)), 0..3);
    let config = vec(ident().prop_map(|id| (ConfigId::new(id.as_str()).unwrap(), Origin::NONE)), 0..3);
    let body = (names(), names(), config, vec(edge(), 0..4), option::of(any_text()));
    let body = (ident(), body).prop_map(|(name, (entry, exit, config, transitions, doc))| State {
        entry,
        exit,
        config,
        transitions,
        doc,
        ..State::new(name)
    });
    let body = body.boxed();
    body.clone().prop_recursive(3, 12, 4, move |inner| {
        let connector = (ident(), option::of(any_text()))
            .prop_map(|(name, doc)| ChartNode::Connector(Connector { doc, ..Connector::new(name) }));
        let child = prop_oneof![3 => inner.prop_map(ChartNode::State), 1 => connector];
        (body.clone(), vec(child, 0..4)).prop_map(|(mut state, mut children)| {
            let reserved = ["entry", "exit", "doo", "config", "doc", "type", "new", "rfsm"];
            let mut seen: BTreeSet<&str> = reserved.into();
            children.retain(|child| seen.insert(child.name().as_str()));
            state.children = children;
            state
        })
    })
}

fn chart() -> impl Strategy<Value = Statechart> {
    state().prop_map(|mut root| {
        root.name = Ident::new("root").unwrap();
        Statechart::new(root)
    })
}

fn time_or_zero() -> impl Strategy<Value = Duration> {
    prop_oneof![1 => Just(Duration::ZERO), 3 => time()]
}

fn port_signal() -> impl Strategy<Value = PortSignal> {
    let part = prop_oneof![ident().prop_map(ValuePart::Field), (0_usize..1000).prop_map(ValuePart::Index)];
    (member(), vec(part, 0..3)).prop_map(|(member, path)| PortSignal { member, path })
}

fn signal() -> impl Strategy<Value = MonitoredSignal> {
    let counter = prop::sample::select(Counter::WORDS.to_vec()).prop_map(|(_, counter)| counter);
    let leaf = prop_oneof![
        3 => port_signal().prop_map(SignalKind::Port),
        2 => finite().prop_map(SignalKind::Constant),
        1 => (member(), time()).prop_map(|(port, over)| SignalKind::Rate { port, over }),
        1 => (ident(), counter).prop_map(|(activity, counter)| SignalKind::Activity { activity, counter }),
    ];
    leaf.prop_map(MonitoredSignal::new).prop_recursive(3, 8, 3, |inner| {
        let list = || vec(inner.clone(), 1..4);
        prop_oneof![
            list().prop_map(SignalKind::Norm),
            list().prop_map(SignalKind::Min),
            list().prop_map(SignalKind::Max),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| SignalKind::Difference(a.into(), b.into())),
            inner.clone().prop_map(|s| SignalKind::Abs(s.into())),
        ]
        .prop_map(MonitoredSignal::new)
    })
}

fn condition() -> impl Strategy<Value = Condition> {
    use ConditionKind as K;
    let op = || prop::sample::select(Comparison::WORDS.to_vec()).prop_map(|(_, op)| op);
    let state =
        prop::sample::select(vec![RunState::Unconfigured, RunState::Stopped, RunState::Running, RunState::Faulted]);
    let leaf = prop_oneof![
        4 => (signal(), op(), signal(), option::of(0.0..1e9_f64)).prop_map(|(left, op, right, h)| K::Compare {
            left,
            op,
            right,
            hysteresis: h.filter(|_| op.is_ordered()),
        }),
        1 => (member(), op(), finite()).prop_map(|(port, op, v)| K::Compare {
            left: MonitoredSignal::new(SignalKind::Age(port)),
            op,
            right: MonitoredSignal::new(SignalKind::Constant(v)),
            hysteresis: None,
        }),
        1 => port_signal().prop_map(K::IsTrue),
        1 => (component(), state).prop_map(|(component, state)| K::InState { component, state }),
        1 => component().prop_map(K::Faulted),
        1 => (member(), time()).prop_map(|(port, time)| K::Silent { port, time }),
    ];
    leaf.prop_map(Condition::new).prop_recursive(4, 12, 3, |inner| {
        let one = || inner.clone().prop_map(Box::new);
        let interval = || {
            (time_or_zero(), option::of(time_or_zero()))
                .prop_map(|(a, b)| Interval { from: b.map_or(a, |b| a.min(b)), to: b.map(|b| a.max(b)) })
        };
        prop_oneof![
            vec(inner.clone(), 1..4).prop_map(K::All),
            vec(inner.clone(), 1..4).prop_map(K::Any),
            one().prop_map(K::No),
            (one(), one()).prop_map(|(a, b)| K::Implies(a, b)),
            one().prop_map(K::Rise),
            one().prop_map(K::Fall),
            (one(), interval()).prop_map(|(condition, interval)| K::Once { condition, interval }),
            (one(), interval()).prop_map(|(condition, interval)| K::Historically { condition, interval }),
            (one(), one(), interval()).prop_map(|(hold, from, interval)| K::Since { hold, from, interval }),
            (one(), time()).prop_map(|(condition, time)| K::ForAtLeast { condition, time }),
            (one(), time()).prop_map(|(condition, time)| K::WithinLast { condition, time }),
        ]
        .prop_map(Condition::new)
    })
}

fn monitors() -> impl Strategy<Value = Vec<Monitor>> {
    let sampling = option::of(time()).prop_map(|t| t.map_or(Sampling::OnSample, Sampling::Every));
    let events = (option::of(event()), option::of(event()));
    let one = (ident(), condition(), events, option::of(time()), sampling, any::<bool>(), option::of(any_text()))
        .prop_map(|(name, when, (raise, cleared), repeat, sampling, enabled, description)| Monitor {
            name,
            when,
            raise,
            cleared,
            // Without an event there is nothing to repeat, which is told.
            repeat: repeat.filter(|_| raise.is_some()),
            sampling,
            enabled,
            description,
            origin: Origin::NONE,
        });
    vec(one, 0..4).prop_map(|mut monitors| {
        let mut seen = BTreeSet::new();
        monitors.retain(|m: &Monitor| seen.insert(m.name));
        monitors
    })
}

fn value_type() -> impl Strategy<Value = ValueType> {
    let leaf = prop::sample::select(vec![ValueType::Bool, ValueType::Int, ValueType::Float, ValueType::Str]);
    leaf.prop_recursive(2, 6, 3, |inner| {
        prop_oneof![
            (inner.clone(), option::of(0_usize..9)).prop_map(|(ty, n)| ValueType::Array(Box::new(ty), n)),
            btree_map(ident(), inner, 1..3).prop_map(|fields| ValueType::Record(fields.into_iter().collect())),
        ]
    })
}

fn component_type() -> impl Strategy<Value = ComponentType> {
    let unit = || option::of(any_text().prop_map(std::sync::Arc::from));
    let port = (any::<[bool; 3]>(), prop_oneof![4 => value_type(), 1 => Just(ValueType::Event)], unit(), any_text())
        .prop_map(|([input, buffered, required], ty, unit, doc)| PortType {
            direction: if input { Direction::In } else { Direction::Out },
            ty,
            unit,
            buffered,
            required: required && input,
            doc,
            origin: Origin::NONE,
        });
    let tunable = prop::sample::select(vec![Tunable::Unconfigured, Tunable::Stopped, Tunable::Always]);
    let limits = prop_oneof![
        (-9.0..0.0_f64, 10.0..19.0_f64, 0.0..10.0_f64).prop_map(|(min, max, v)| (
            ValueType::Float,
            Some(min),
            Some(max),
            Some(Value::Float(v))
        )),
        (value_type(), option::of(finite())).prop_map(|(ty, min)| (ty, min, None, None)),
        any_text().prop_map(|v| (ValueType::Str, None, None, Some(Value::str(&v)))),
    ];
    let property = (limits, tunable, unit(), any_text()).prop_map(|((ty, min, max, default), tunable, unit, doc)| {
        // What names an event has an event's name for its default.
        let raises = ty == ValueType::Str && default.is_none();
        PropertyType { ty, default, min, max, tunable, raises, unit, doc, origin: Origin::NONE }
    });
    let effect = prop_oneof![Just(Effect::None), Just(Effect::Irreversible), ident().prop_map(Effect::Undo)];
    let settled = option::weighted(0.2, condition());
    let operation = (vec(value_type(), 0..3), option::of(value_type()), effect, any::<bool>(), settled, any_text())
        .prop_map(|(args, returns, effect, moves, settled_by, doc)| OperationType {
            args,
            returns,
            effect,
            moves,
            settled_by,
            doc,
            origin: Origin::NONE,
        });
    let members =
        (btree_map(ident(), port, 0..3), btree_map(ident(), property, 0..3), btree_map(ident(), operation, 0..3));
    let raises = btree_map(event(), Just(String::new()), 0..3);
    let others = (raises, vec(type_name(), 0..2), vec(type_name(), 0..2), any::<[bool; 6]>());
    (type_name(), any_text(), members, others).prop_map(
        |(
            name,
            doc,
            (ports, properties, operations),
            (raises, start_after, stop_before, [actuator, configure, stop, destroy, starting, stopping]),
        )| ComponentType {
            doc,
            ports,
            properties,
            operations,
            raises,
            start_after,
            stop_before,
            actuator,
            moves: Moves { start: starting, stop: stopping },
            irreversible: Irreversible { configure, stop, destroy },
            ..ComponentType::new(name.as_str(), "")
        },
    )
}

fn deployment() -> impl Strategy<Value = Deployment> {
    let activity = (option::of(time()), 0_u8..100, option::of(0_u32..64))
        .prop_map(|(period, priority, cpu)| Activity { period, priority, cpu, origin: Origin::NONE });
    let path = || "[a-z]{1,4}(\\.[a-z]{1,4}){0,2}";
    let up = (event(), time()).prop_map(|(event, within)| BringUp { event, within });
    let rest = btree_set(config_id(), 0..3).prop_map(placed);
    let down = (event(), time(), rest).prop_map(|(event, within, rest)| TakeDown { event, within, rest });
    let types = vec(component_type(), 0..3).prop_map(|mut types| {
        let mut seen = BTreeSet::new();
        types.retain(|ty| seen.insert(ty.name));
        types
    });
    let reaction =
        ("(start|stop|create) [a-z]{1,4}", time(), event(), ident()).prop_map(|(after, delay, raise, name)| {
            let component = ComponentName::new(name.as_str()).unwrap();
            SimulatedReaction { after, delay, raise, component, origin: Origin::NONE }
        });
    let how = prop::sample::select(FaultKind::WORDS.to_vec()).prop_map(|(_, how)| how);
    let fault = ("(start|stop|property_set) [a-z]{1,4}(\\.[a-z])?", how, 1_u32..4, time()).prop_map(
        |(step, how, times, takes)| {
            let takes = if how == FaultKind::Slow { takes } else { Duration::ZERO };
            StepFault { step, how, times, takes, origin: Origin::NONE }
        },
    );
    // One frame would hold nothing beside the configuration that is being pushed; the loader refuses it.
    let limits = (2_usize..=100_000, time()).prop_map(|(stack, step_timeout)| DeploymentLimits { stack, step_timeout });
    let may = prop_oneof![config_id().prop_map(OperatorMay::Apply), member().prop_map(OperatorMay::Set)];
    let watched = (btree_set(event(), 0..3).prop_map(placed), btree_set(may, 0..3).prop_map(placed));
    let ends = (vec(reaction, 0..3), vec(fault, 0..3), watched, btree_map(ident(), value(), 0..3));
    let parts = (types, btree_map(ident(), activity, 0..3), btree_set(event(), 0..3), up, down, limits, ends);
    let coordinator = (option::of(ident()), chart(), path(), vec(path(), 0..3), path());
    let coordinators = vec(coordinator, 1..4);
    (vec(ident(), 2..5), configurations(), coordinators, monitors(), parts).prop_map(
        |(
            names,
            configurations,
            coordinators,
            monitors,
            (
                types,
                activities,
                emits,
                deploy,
                shutdown,
                limits,
                (reactions, faults, (safety, operator), platform_options),
            ),
        )| Deployment {
            platform_options,
            // Each once.
            libraries: names[2..].iter().copied().collect::<BTreeSet<_>>().into_iter().collect(),
            types,
            activities,
            configurations,
            coordinators: {
                let mut taken = BTreeSet::new();
                let made = |(at, (name, chart, up, failed, down)): (usize, (Option<Ident>, _, _, _, _))| {
                    // Only the first one can stand under `coordinator`.
                    let written =
                        if at == 0 && name.is_none() { CoordinatorNaming::Alone } else { CoordinatorNaming::Named };
                    let name = name.unwrap_or(names[0]);
                    taken.insert(name).then_some(Coordinator {
                        name,
                        written,
                        chart,
                        up,
                        failed,
                        down,
                        of: None,
                        origin: Origin::NONE,
                    })
                };
                coordinators.into_iter().enumerate().filter_map(made).collect()
            },
            monitors,
            emits: placed(emits),
            safety,
            operator,
            limits,
            reactions,
            faults,
            ..Deployment::new(names[0], names[1], deploy, shutdown)
        },
    )
}

const LANGUAGES: [(Language, &str); 2] = [(Language::Lua, "x.lua"), (Language::Yaml, "x.yaml")];

proptest! {
    #![proptest_config(cases())]

    #[test]
    fn text_law_configurations(list in configurations()) {
        for (language, file) in LANGUAGES {
            let text = print::configurations(&list, language);
            let loaded = lang::load_configurations(&Sources::memory([(file, text.as_str())]), Path::new(file), &LoadOptions::default());
            prop_assert!(loaded.findings.is_empty(), "{}\n{text}", shown(&loaded.findings, &loaded.sources));
            prop_assert_eq!(&loaded.configurations, &list, "{}", text);
        }
    }

    #[test]
    fn text_law_coordinators(chart in chart()) {
        for (language, file) in LANGUAGES {
            let text = print::coordinator(&chart, language);
            let loaded = lang::load_coordinator(&Sources::memory([(file, text.as_str())]), Path::new(file), &LoadOptions::default());
            prop_assert!(loaded.findings.is_empty(), "{}\n{text}", shown(&loaded.findings, &loaded.sources));
            prop_assert_eq!(loaded.coordinator.as_ref(), Some(&chart), "{}", text);
        }
    }

    #[test]
    fn text_law_monitors(list in monitors()) {
        for (language, file) in LANGUAGES {
            let text = print::monitors(&list, language);
            let loaded = lang::load_monitors(&Sources::memory([(file, text.as_str())]), Path::new(file), &LoadOptions::default());
            prop_assert!(loaded.findings.is_empty(), "{}\n{text}", shown(&loaded.findings, &loaded.sources));
            prop_assert_eq!(&loaded.monitors, &list, "{}", text);
        }
    }

    #[test]
    fn text_law_deployments(deployment in deployment()) {
        for (language, _) in LANGUAGES {
            let files = print::deployment(&deployment, language);
            let main = files[0].0.clone();
            let loaded = lang::load_from(&Sources::memory(files.clone()), Path::new(&main), &LoadOptions::default());
            prop_assert!(loaded.findings.is_empty(), "{}\n{}", shown(&loaded.findings, &loaded.sources), files[0].1);
            let mut back = loaded.deployment.unwrap();
            back.key_origins.clear();
            prop_assert_eq!(&back, &deployment, "{}", files[0].1);
        }
    }
}
