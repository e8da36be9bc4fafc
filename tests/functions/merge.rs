//! `docs/rfsm.md` §8: looking for paths in a machine that runs, adding to it, and leaving a part of it.

use super::deployed::said_by;
use super::lab::run;
use super::support::Model;

#[test]
fn node_find_enabled_gives_the_tree_of_complete_paths() {
    run(r#"
        local seen = {}
        local fsm = init(S {
          a = S {}, b = S {}, c = S {}, via = C {}, stuck = C {},
          T { src = "initial", tgt = "a" },
          T { src = "a", tgt = "via", events = { "e_go" } },
          T { src = "a", tgt = "stuck", events = { "e_go" }, pn = 5 },
          T { src = "stuck", tgt = "b", events = { "e_other" } },
          T { src = "via", tgt = "b", guard = function(tr, events) seen[#seen + 1] = events[1] end },
          T { src = "via", tgt = "c", events = { function(e) return e == "e_go" end } },
        })
        rfsm.run(fsm)
        eq(rfsm.node_find_enabled(fsm, fsm.a, { "e_no" }), false)
        eq(rfsm.node_find_enabled(fsm, fsm.b, { "e_go" }), false, "nothing leads out")
        local path = rfsm.node_find_enabled(fsm, fsm.a, { "e_no", "e_go" })
        assert(path.node == fsm.a)
        eq(#path.nextl, 1, "the dead end is left out")
        assert(path.nextl[1].trans.tgt == fsm.via and path.nextl[1].next.node == fsm.via)
        local on = path.nextl[1].next.nextl
        eq(#on, 2)
        assert(on[1].trans.tgt == fsm.b and on[2].trans.tgt == fsm.c)
        assert(on[1].next.node == fsm.b and on[1].next.nextl == false)
        eq(seen, { "e_no" }, "the guard got the events that were given")
        eq(leaf(fsm), "root.a", "nothing is taken")
        eq(pcall(rfsm.node_find_enabled, fsm, fsm.a._transitions, {}), false)
        eq(pcall(rfsm.node_find_enabled, fsm, "a", {}), false)
    "#);
}

#[test]
fn node_find_enabled_sees_guards_that_fail_and_priorities() {
    run(r#"
        local fsm = init(S {
          a = S {}, b = S {}, c = S {},
          T { src = "initial", tgt = "a" },
          T { src = "a", tgt = "b", guard = function() error("no") end },
          T { src = "a", tgt = "b", guard = function() return false end },
          T { src = "a", tgt = "b" },
          T { src = "a", tgt = "c", pn = 1 },
        })
        rfsm.run(fsm)
        lines = {}
        local path = rfsm.node_find_enabled(fsm, fsm.a, {})
        eq(#path.nextl, 2)
        assert(path.nextl[1].trans.tgt == fsm.c and path.nextl[2].trans.tgt == fsm.b)
        eq(lines[1]:sub(1, 31), "GUARDerror executing guard of T")
    "#);
}

#[test]
fn a_state_a_connector_and_transitions_are_added_to_a_machine_that_runs() {
    run(r#"
        local log = {}
        local function note(what) return function(fsm, s) log[#log + 1] = what .. (s._id or "") end end
        local fsm = init(S {
          a = S { exit = note("-") }, box = S { entry = note("+"), inner = S {}, T { src = "initial", tgt = "inner" } },
          T { src = "initial", tgt = "a" },
          T { src = "a", tgt = "box", events = { "e_box" } },
        })
        rfsm.run(fsm)
        local new = S { entry = note("+"), exit = note("-"), doo = function() log[#log + 1] = "doo" end }
        eq(rfsm.fsm_merge(fsm, fsm.box, new, "late"), true)
        eq(new._fqn, "root.box.late")
        assert(fsm.box.late == new and new._parent == fsm.box)
        eq(rfsm.get_sta_mode(new), "inactive")
        eq(rfsm.fsm_merge(fsm, fsm, C {}, "via"), true)
        eq(rfsm.fsm_merge(fsm, fsm, T { src = fsm.a, tgt = fsm.via, events = "e_new", effect = note("!") }), true)
        eq(rfsm.fsm_merge(fsm, fsm, T { src = fsm.via, tgt = new }), true)
        eq(rfsm.fsm_merge(fsm, fsm, T { src = new, tgt = fsm.a, events = { "e_done" } }), true)
        rfsm.send_events(fsm, "e_new")
        rfsm.step(fsm)
        eq(rfsm.get_active_conf(fsm), { "root", "root.box", "root.box.late" })
        eq(rfsm.get_sta_mode(new), "active")
        assert(rfsm.actchild_get(fsm.box) == new)
        rfsm.run(fsm)
        eq(leaf(fsm), "root.a", "its completion leads back")
        eq(log, { "-a", "!", "+box", "+late", "doo", "-late" })
        rfsm.send_events(fsm, "e_box")
        rfsm.run(fsm)
        eq(leaf(fsm), "root.box.inner", "what was there is as it was")
        rfsm.reset(fsm)
        rfsm.run(fsm)
        rfsm.send_events(fsm, "e_new")
        rfsm.step(fsm)
        eq(leaf(fsm), "root.box.late", "a reset keeps what was added")
    "#);
}

#[test]
fn an_added_transition_stands_behind_the_others_whatever_its_priority() {
    run(r#"
        local fsm = init(S {
          a = S {}, b = S {}, c = S {},
          T { src = "initial", tgt = "a" },
          T { src = "a", tgt = "b", events = { "e_go" } },
          T { src = "b", tgt = "a", events = { "e_back" } },
        })
        rfsm.run(fsm)
        local swift = T { src = fsm.a, tgt = fsm.c, events = { "e_go", "e_c" }, pn = 100 }
        assert(rfsm.fsm_merge(fsm, fsm, swift))
        local path = rfsm.node_find_enabled(fsm, fsm.a, { "e_go" })
        assert(path.nextl[1].trans.tgt == fsm.b and path.nextl[2].trans == swift)
        rfsm.send_events(fsm, "e_go")
        rfsm.run(fsm)
        eq(leaf(fsm), "root.b")
        -- Again and again, at two sources in turn: those of a source move, and stay in their order.
        for i = 1, 20 do
          assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.a, tgt = fsm.c, events = { "e_a" .. i } }))
          assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.c, tgt = fsm.a, events = { "e_c" .. i } }))
        end
        rfsm.send_events(fsm, "e_back")
        rfsm.run(fsm)
        for i = 1, 20 do
          rfsm.send_events(fsm, "e_a" .. i)
          rfsm.run(fsm)
          eq(leaf(fsm), "root.c")
          rfsm.send_events(fsm, "e_c" .. i)
          rfsm.run(fsm)
          eq(leaf(fsm), "root.a")
        end
        rfsm.send_events(fsm, "e_c", "e_go")
        rfsm.run(fsm)
        eq(leaf(fsm), "root.b", "the first one still goes first")
    "#);
}

#[test]
fn events_that_wait_are_known_to_what_is_added_after_them() {
    run(r#"
        local odd = {}
        local fsm = init(S {
          a = S {}, b = S {}, c = S {},
          T { src = "initial", tgt = "a" },
          T { src = "b", tgt = "c", events = { "e_known" } },
        })
        rfsm.step(fsm) -- the completion of `a` waits, and nothing listens to it yet
        assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.a, tgt = fsm.b, events = { "e_done" } }))
        rfsm.step(fsm)
        eq(leaf(fsm), "root.b")
        rfsm.send_events(fsm, "e_text", odd)
        assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.b, tgt = fsm.a, events = { odd }, guard = function(tr, events)
          return events[#events] == odd
        end }))
        rfsm.step(fsm)
        eq(leaf(fsm), "root.a", "an event that is no text")
        rfsm.run(fsm)
    "#);
}

#[test]
fn what_a_function_adds_is_there_from_the_next_step_on() {
    run(r#"
        local fsm
        fsm = init(S {
          a = S { entry = function(fsm, s)
            if fsm.late then return end
            local late = S { entry = function() say("late") end }
            assert(rfsm.fsm_merge(fsm, fsm, late, "late"))
            assert(rfsm.fsm_merge(fsm, fsm, T { src = s, tgt = late, events = { "e_late" } }))
            rfsm.send_events(fsm, "e_late")
            say("merged")
          end },
          T { src = "initial", tgt = "a" },
        })
        lines = {}
        rfsm.run(fsm)
        eq(leaf(fsm), "root.late")
        eq(lines, { "merged", "late" })
    "#);
}

#[test]
fn what_cannot_be_added_is_said_and_nothing_changes() {
    run(r#"
        local fsm = init(S {
          a = S {}, worker = S { doo = function() end }, via = C {}, box = S { x = S {}, T { src = "initial", tgt = "x" } },
          T { src = "initial", tgt = "a" },
        })
        rfsm.run(fsm)
        local other = init(S { o = S {}, T { src = "initial", tgt = "o" } })
        local function refused(why, ...)
          lines = {}
          eq(rfsm.fsm_merge(fsm, ...), false, why)
          eq(#lines, 1)
          assert(lines[1]:find(why, 1, true), lines[1])
        end
        refused("not a state", fsm.via, S {}, "x")
        refused("not a state", "a", S {}, "x")
        refused("parent root.worker defines a doo function!", fsm.worker, S {}, "x")
        refused("already contains a sub element a", fsm, S {}, "a")
        refused("without an id", fsm, S {})
        refused("without an id", fsm, C {})
        refused("the id must be a text", fsm, S {}, 7)
        refused("cannot be the name of a state", fsm, S {}, "two words")
        refused("neither a state", fsm, 12, "x")
        refused("not a node", fsm, T { src = "a", tgt = "box" })
        refused("no state or connector of this machine", fsm, T { src = other.o, tgt = fsm.a })
        refused("in this machine already", fsm, fsm.a, "again")
        refused("in this machine already", fsm, fsm[1])
        refused("merging of state objects not implemented (x)", fsm, S { y = S {}, T { src = "initial", tgt = "y" } }, "x")
        refused("root", fsm, T { src = fsm, tgt = fsm.a })
        refused("time event", fsm, T { src = fsm.a, tgt = fsm.box.x, events = { "e_after(1)" } })
        refused("`guard`", fsm, T { src = fsm.a, tgt = fsm.box.x, guard = 3 })
        eq(pcall(rfsm.fsm_merge, {}, fsm, S {}, "x"), false)
        eq(fsm.x, nil)
        rfsm.send_events(fsm, "e_any")
        rfsm.run(fsm)
        eq(leaf(fsm), "root.a", "nothing leads out of it")
    "#);
}

#[test]
fn a_path_that_ends_at_a_composite_state_is_none_and_said() {
    run(r#"
        local fsm = init(S {
          a = S {}, b = S {}, box = S { x = S {}, T { src = "initial", tgt = "x" } },
          T { src = "initial", tgt = "a" },
        })
        rfsm.run(fsm)
        -- Resolved already: a composite target is not exchanged for its `initial`.
        assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.a, tgt = fsm.box, events = { "e_go" } }))
        assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.a, tgt = fsm.b, events = { "e_go" } }))
        lines = {}
        rfsm.send_events(fsm, "e_go")
        rfsm.run(fsm)
        eq(lines, { "ERROR: node_find_path invalid starting noderoot.a, typestate" })
        eq(leaf(fsm), "root.b")
    "#);
}

#[test]
fn a_leaf_that_gets_a_child_goes_on_as_a_leaf() {
    run(r#"
        local fsm = init(S {
          a = S {}, b = S {},
          T { src = "initial", tgt = "a" },
          T { src = "a", tgt = "b", events = { "e_b" } },
          T { src = "b", tgt = "a", events = { "e_a" } },
        })
        rfsm.run(fsm)
        local deep = S { entry = function() say("+deep") end, exit = function() say("-deep") end }
        assert(rfsm.fsm_merge(fsm, fsm.b, deep, "deep"))
        assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.a, tgt = deep, events = { "e_deep" } }))
        rfsm.send_events(fsm, "e_b")
        rfsm.run(fsm)
        eq(leaf(fsm), "root.b", "a leaf still")
        lines = {}
        rfsm.send_events(fsm, "e_a") rfsm.run(fsm)
        rfsm.send_events(fsm, "e_deep") rfsm.run(fsm)
        eq(rfsm.get_active_conf(fsm), { "root", "root.b", "root.b.deep" })
        rfsm.send_events(fsm, "e_a") rfsm.run(fsm)
        eq(lines, { "+deep", "-deep" })
        eq(leaf(fsm), "root.a")
    "#);
}

#[test]
fn connectors_that_lead_round_only_by_what_was_added_are_told() {
    run(r#"
        local fsm = init(S {
          a = S {}, x = C {}, y = C {},
          T { src = "initial", tgt = "a" },
          T { src = "a", tgt = "x", events = { "e_go" } },
          T { src = "x", tgt = "y" },
        })
        rfsm.run(fsm)
        assert(rfsm.fsm_merge(fsm, fsm, T { src = fsm.y, tgt = fsm.x }))
        rfsm.send_events(fsm, "e_go")
        rfsm.run(fsm)
        eq(leaf(fsm), "root.a")
        eq(pcall(rfsm.node_find_enabled, fsm, fsm.a, { "e_go" }), false)
    "#);
}

#[test]
fn a_part_of_a_machine_is_left_with_its_exits_and_the_rest_stays_active() {
    run(r#"
        local log = {}
        local function out(fsm, s) log[#log + 1] = s._id end
        local fsm = init(S {
          exit = out,
          box = S { exit = out, x = S { exit = out }, y = S { exit = out }, T { src = "initial", tgt = "x" },
                    T { src = "x", tgt = "y", events = { "e_y" } } },
          away = S { exit = out },
          T { src = "initial", tgt = "box" },
          T { src = "box", tgt = "away", events = { "e_away" } },
        })
        rfsm.run(fsm)
        rfsm.exit_state(fsm, fsm.box.y) -- not active: nothing to leave
        rfsm.exit_state(fsm, fsm.initial)
        eq(log, {})
        rfsm.exit_state(fsm, fsm.box.x)
        eq(log, { "x" })
        eq(rfsm.get_active_conf(fsm), { "root", "root.box" })
        eq(rfsm.get_actleaf_fqn(fsm), false)
        eq(rfsm.get_sta_mode(fsm.box.x), "inactive")
        eq(rfsm.get_sta_mode(fsm.box), "active")
        eq(rfsm.actchild_get(fsm.box), false)
        rfsm.send_events(fsm, "e_y")
        eq(rfsm.run(fsm), true, "what was left takes no part")
        eq(rfsm.get_active_conf(fsm), { "root", "root.box" })
        rfsm.send_events(fsm, "e_away")
        rfsm.run(fsm)
        eq(leaf(fsm), "root.away", "what stayed does")
        eq(log, { "x", "box" })
        rfsm.exit_state(fsm, fsm)
        eq(log, { "x", "box", "away", "root" })
        rfsm.run(fsm)
        eq(leaf(fsm), "root.box.x", "after the root was left, a step enters it")
    "#);
}

const GROWS: &str = r#"
return rfsm.state {
  idle = rfsm.state {
    entry = function(fsm, state)
      if fsm.extra then return end
      local extra = rfsm.state { entry = function() print("extra") end }
      rfsm.fsm_merge(fsm, fsm, extra, "extra")
      rfsm.fsm_merge(fsm, fsm, rfsm.trans { src = state, tgt = extra, events = { "e_extra" } })
      rfsm.fsm_merge(fsm, fsm, rfsm.trans { src = extra, tgt = state, events = { "e_back" } })
    end,
  },
  rfsm.trans { src = "initial", tgt = "idle" },
}
"#;

#[test]
fn a_coordinator_may_add_to_itself() {
    let model = Model::new(GROWS);
    let mut sim = model.sim();
    let seen = sim.line("run").unwrap();
    assert_eq!(seen.active, ["root", "root.idle"]);
    let seen = sim.line("e_extra").unwrap();
    assert_eq!(seen.active, ["root", "root.extra"]);
    assert_eq!(seen.actions, ["exit root.idle", "entry root.extra"]);
    assert_eq!(seen.queue, ["e_done@root.extra"]);
    assert_eq!(sim.chart().fqn(sim.machine().leaf().unwrap()).to_string(), "root.extra");
    sim.line("run").unwrap();
    assert_eq!(sim.line("e_back").unwrap().active, ["root", "root.idle"]);
}

#[test]
fn a_deployments_coordinator_may_add_to_itself_and_its_requests_are_answered() {
    // The state that asks for `make` is not in the file.
    let coordinator = r#"
return rfsm.state {
  idle = rfsm.state {
    entry = function(fsm, state)
      if fsm.starting then return end
      local starting = rfsm.state { entry = "make" }
      rfsm.fsm_merge(fsm, fsm, starting, "starting")
      rfsm.fsm_merge(fsm, fsm, rfsm.trans { src = fsm.begun, tgt = starting, events = { "e_done" } })
      rfsm.fsm_merge(fsm, fsm, rfsm.trans { src = starting, tgt = fsm.operational, events = { "make.ok" },
        effect = function(fsm, tr, what, events) print("answered by " .. events[1]) end })
    end,
  },
  begun = rfsm.state {}, operational = rfsm.state {}, stopping = rfsm.state { entry = "make.undo" }, fault = rfsm.state {},
  rfsm.trans { src = "initial", tgt = "idle" },
  rfsm.trans { src = "idle", tgt = "begun", events = { "e_start" } },
  rfsm.trans { src = "operational", tgt = "stopping", events = { "e_stop" } },
  rfsm.trans { src = "stopping", tgt = "idle", events = { "make.undone" } },
  rfsm.trans { src = "stopping", tgt = "fault", events = { "make.undo.failed", "make.undo.broken" } },
}
"#;
    assert_eq!(said_by(coordinator, 1), ["info: answered by make.ok"]);
}
