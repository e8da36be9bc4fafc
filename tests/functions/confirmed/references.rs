//! References that lead nowhere: what `rfsm.init` says of them (docs/rfsm.md §3).

use crate::lab::run;

#[test]
fn each_failed_reference_is_told_with_rfsms_words() {
    let cases = [
        ("src", "nobody", "no nobody in root"),
        ("src", "root", "no root in root"),
        ("src", "root.a.x", "no x in a"),
        ("src", ".dock", "no dock in "),
        ("tgt", "root.lighthouse.lamp", "no lighthouse in lighthouse"),
        ("tgt", "a.b.c.d", "no b in a.b.c"),
        ("tgt", ".root.dock.x", "no dock in dock"),
        ("tgt", "a\\\\x", "no x in a"),
    ];
    for (end, text, why) in cases {
        let (src, tgt) = if end == "src" { (text, "a") } else { ("a", text) };
        run(&format!(
            "eq(init(S {{ a = S {{}}, T {{ src='initial', tgt='a' }}, T {{ src='{src}', tgt='{tgt}', events={{'e'}} }} }}), false)
             local of = lines[1]:match('^ERROR: resolving {end} failed T={{ src=.- }}: (.*)$')
             eq(of, '{why}') eq(lines[2], 'ERROR: failed to resolve transitions of fsm root') eq(#lines, 2)"
        ));
    }
}

#[test]
fn every_transition_is_tried() {
    run("eq(init(S { a = S { y = S {} }, b = S {}, T { src='initial', tgt='b' }, T { src='x', tgt='b' }, T { src='b', tgt='x' }, T { src='b', tgt='a' }, T { src='b', tgt='internal' } }), false)
         assert(lines[1]:find('^ERROR: resolving src failed') and lines[2]:find('^ERROR: resolving tgt failed'))
         eq(lines[3], \"ERROR: transition T={ src='root.b', tgt='a', events='{}' } ends on composite state without initial connector\")
         eq(lines[4], 'ERROR: internal events not supported (yet?)')
         eq(lines[5], 'ERROR: failed to resolve transitions of fsm root') eq(#lines, 5)");
}

#[test]
fn a_dotted_reference_of_a_composed_model_starts_at_the_top() {
    run("local sub = function(tgt) return S { faults = S { dispatch = S {} }, T { src='initial', tgt=tgt } } end
         eq(init(S { sub = sub 'faults.dispatch', T { src='initial', tgt='sub' } }), false)
         assert(lines[1]:find(': no faults in faults$'), lines[1])
         for _, tgt in ipairs { '.faults.dispatch', 'root.sub.faults.dispatch', 'sub.faults.dispatch', 'root.root.sub.faults.dispatch', '.root.faults.dispatch' } do
           local fsm = init(S { sub = sub(tgt), T { src='initial', tgt='sub' } }) rfsm.run(fsm) eq(leaf(fsm), 'root.sub.faults.dispatch', tgt)
         end
         local alone = init(sub 'faults.dispatch') rfsm.run(alone) eq(leaf(alone), 'root.faults.dispatch')");
}

/// rFSM takes them and trips later, with an error of Lua.
#[test]
fn a_reference_to_a_field_that_is_no_node_makes_no_machine() {
    for tgt in ["entry", "note", "type", "new", "rfsm", "go"] {
        run(&format!(
            "eq(init(S {{ a = S {{}}, entry = function() end, note = 'x', go = T {{ src='a', tgt='a', events={{'f'}} }},
               T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='{tgt}', events={{'e'}} }} }}), false) assert(#lines > 0)"
        ));
    }
    run(
        "eq(init(S { a = S {}, T { src='initial', tgt='a' }, T { src='.', tgt='a', events={'e'} } }), false, 'nor one of the root')",
    );
}
