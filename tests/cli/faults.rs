//! Faults of the simulated platform, as deployments and scripts ask for them.

use crate::demo::{Demo, Ran};

/// Brings the demo up, says what goes wrong with setting `k`, and asks for it.
fn asked_for(how: &str, then: &str) -> Ran {
    let demo = Demo::new();
    demo.write(
        "script.lua",
        &format!(
            "deploy('deployment.yaml')
             wait_answer('slow.ok', 1)
             fault('property_set source.k', '{how}')
             local began = now()
             raise('e_fast')
             {then}"
        ),
    );
    demo.run(&["run", "script.lua", "--clock", "simulated"])
}

#[test]
fn fail_is_said_at_once_and_only_so_often() {
    let ran = asked_for(
        "fail",
        "wait_answer('fast.failed', 5)
         assert(now() == began)
         wait_state('slow_mode', 1)
         raise('e_fast')
         wait_answer('fast.ok', 1)
         fault('property_set source.k', 'fail', 2)
         for _ = 1, 2 do raise('e_slow') wait(1) raise('e_fast') wait(1) end
         shutdown()",
    );
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("a failure was injected"), "{}", ran.out);
}

#[test]
fn lost_is_not_done_and_nobody_says_so() {
    let ran = asked_for(
        "lost",
        "wait_answer('fast.failed', 5)
         assert(now() - began >= 1 and now() - began < 1.5)
         wait_state('slow_mode', 1)
         raise('e_fast')
         wait_answer('fast.ok', 1)
         assert(property('source.k') == 9)
         shutdown()",
    );
    assert_eq!(ran.code, 0, "the component is well: {}{}", ran.out, ran.err);
}

#[test]
fn hang_keeps_the_component_and_late_gives_it_back() {
    let then = "wait_answer('fast.failed', 5)
         assert(now() - began >= 1 and now() - began < 1.5)
         wait(60)
         shutdown()";
    let ran = asked_for("late", then);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("source returned"), "{}", ran.out);
    let ran = asked_for("hang", then);
    assert_ne!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("source") && ran.err.contains("quarantined"), "{}", ran.err);
}

#[test]
fn lie_says_done_and_is_not() {
    let demo = Demo::new();
    // It is said before anything is there, and waits for the deployment.
    demo.write("script.lua", "fault('create source', 'lie') deploy('deployment.yaml')");
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("connect_all.failed"), "what it is connected to is not there: {}", ran.out);
    assert!(!ran.out.contains("create_all.failed"), "{}", ran.out);
}

#[test]
fn a_deployment_says_it_too() {
    let demo = Demo::new();
    demo.replace(
        "deployment.yaml",
        "deploy:   {",
        "faults:\n  - { step: start source, how: fail }\n  - { step: property_set source.k = 9.0, how: fail, times: 2 }\ndeploy:   {",
    );
    let checked = demo.run(&["check", "deployment.yaml"]);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    demo.write("script.lua", "deploy('deployment.yaml')");
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("start_all.failed"), "{}", ran.out);
    let deployed = demo.run(&["deploy", "deployment.yaml", "--clock", "simulated"]);
    assert_eq!(deployed.code, 1, "the same without a script: {}{}", deployed.out, deployed.err);
    assert!(deployed.out.contains("start_all.failed"), "{}", deployed.out);
    // The other one, in the middle: twice, and then no more.
    demo.replace("deployment.yaml", "  - { step: start source, how: fail }\n", "");
    demo.write(
        "script.lua",
        "deploy('deployment.yaml')
         for _ = 1, 2 do raise('e_fast') wait_answer('fast.failed', 1) wait_state('slow_mode', 1) end
         raise('e_fast') wait_answer('fast.ok', 1) shutdown()",
    );
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

/// What is said of a script in the demo that fails.
fn refused(script: &str) -> String {
    let demo = Demo::new();
    demo.write("script.lua", script);
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 1, "{script}: {}{}", ran.out, ran.err);
    ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
}

#[test]
fn wait_takes_seconds_and_says_what_waits_for_an_answer() {
    let said = refused("deploy('deployment.yaml') wait('fast.ok')");
    assert!(said.contains("what waits for an answer is `wait_answer("), "{said}");
}

#[test]
fn what_cannot_go_wrong_is_refused_before_or_after_the_deployment() {
    for (fault, says) in [
        ("fault('property_set source.k', 'fial')", "`fial` is no kind of fault: did you mean `fail`?"),
        ("fault('property_set source.k', 'fail', 0)", "0 is not a number of times"),
        ("fault('property_set source.k', 'fail', 1.5)", "1.5 is not a number of times"),
        ("fault('property_set source.k', 'fail', 1e9)", "1000000000 is not a number of times"),
        ("fault('property_set source.k', 'fail', 0/0)", "is not a number of times"),
        ("fault('proprety_set source.k', 'fail')", "did you mean `property_set`?"),
        ("fault('', 'fail')", "`` is no step"),
        ("fault('property_set source.kk', 'fail')", "did you mean `k`?"),
        ("fault('start sourc', 'fail')", "did you mean `source`?"),
        // What is there, but no configuration does it.
        ("fault('operation_call source.burn', 'fail')", "no configuration calls `source.burn`"),
        ("fault('connect source.y -> sink.w', 'fail')", "did you mean `source.y -> sink.u`?"),
        ("fault('disconnect source.n', 'hang')", "no configuration connects or disconnects `source.n`"),
    ] {
        for script in [format!("{fault} deploy('deployment.yaml')"), format!("deploy('deployment.yaml') {fault}")] {
            let said = refused(&script);
            assert!(said.contains(says) && said.contains("script.lua:1"), "{script}: {said}");
        }
    }
    let fine = "deploy('deployment.yaml')
        for _, step in ipairs { 'start', 'connect', 'disconnect source.y -> sink.u', 'connect source.y -> sink.u (data)',
            'operation_call source.reset', 'operation_call source.reset(0.5)', 'property_set source.k = 3.0',
            'port_write sink.flag', 'create sink : Sink', ' destroy   sink ' } do
          fault(step, 'fail')
        end";
    let demo = Demo::new();
    demo.write("script.lua", fine);
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert!(ran.err.is_empty() || !ran.err.contains("fault"), "{}", ran.err);
}

#[test]
fn a_fault_in_the_file_that_never_comes_is_a_finding() {
    for (step, help) in [("operation_call source.burn", "source.reset"), ("connect source.y -> sink.w", "sink.u")] {
        let demo = Demo::new();
        let line = 1 + demo.replace(
            "deployment.yaml",
            "deploy:   {",
            &format!("faults:\n  - {{ step: {step}, how: lie }}\ndeploy:   {{"),
        );
        let ran = demo.run(&["check", "deployment.yaml", "--json"]);
        assert_eq!(ran.code, 1, "{}", ran.out);
        let json = ran.json();
        let found = json["findings"].as_array().unwrap().iter().find(|f| f["severity"] == "error").unwrap();
        assert_eq!(found["code"], "simulated::unknown_step", "{step}");
        assert_eq!(found["line"], line as u64, "{step}");
        assert!(found["help"].as_str().unwrap().contains(help), "{step}: {found}");
    }
}

#[test]
fn an_embedded_deployment_runs_on_the_simulated_platform() {
    let hello = concat!(env!("CARGO_MANIFEST_DIR"), "/deployments/hello.yaml");
    let demo = Demo::new();
    let script = format!(
        "deploy('{hello}')
         wait_state('soft', 1) wait_answer('quiet.ok', 1)
         fault('property_set gain.k', 'fail')
         raise('e_loud') wait_answer('loud.failed', 1)
         wait_state('failed', 1)
         shutdown()"
    );
    demo.write("script.lua", &script);
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    // On its own platform nothing can be made to go wrong so, and that is said.
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    let said = ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
    assert!(said.contains("the platform is `embedded`") && said.contains("--platform simulated"), "{said}");
    let ran = demo.run(&["run", "script.lua", "--platform", "simulatde"]);
    assert_eq!(ran.code, 2, "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("simulated"), "{}", ran.err);
}

#[test]
fn what_simulated_components_raise_is_raised_there() {
    // The deployment is meant for the embedded platform; what it says of simulated components counts on the simulated one.
    let demo = Demo::new();
    let hello = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/deployments/hello.yaml")).unwrap();
    let home = concat!(env!("CARGO_MANIFEST_DIR"), "/configs/");
    let reaction = "{ after: start gain, delay_s: 0.5, raise: e_loud, component: gain }";
    let hello = hello.replace("../configs/", home).replace("deploy: {", "deploy:   {");
    let with = hello.replacen("deploy:", &format!("simulated: {{ reactions: [{reaction}] }}\ndeploy:"), 1);
    demo.write("hello.yaml", &with);
    demo.write("script.lua", "deploy('hello.yaml') wait_state('hard', 5) shutdown()");
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 1, "there nobody raises it: {}{}", ran.out, ran.err);
}

#[test]
fn a_component_fails_by_itself_and_what_cannot_fail_is_told() {
    for (script, says) in [
        ("fail('source')", "nothing is deployed"),
        ("deploy('deployment.yaml') fail('sourc')", "did you mean `source`?"),
        ("deploy('deployment.yaml') fail('not a name')", "there is no component `not a name`"),
        ("deploy('deployment.yaml', {replay = true}) fail('source')", "`source` is not there now"),
        ("deploy('deployment.yaml') raise('e_fast', { to = 'dem' })", "did you mean `demo`?"),
        ("deploy('deployment.yaml') raise('e_fast', { to = { 1 } })", "`to` is a name or a list of names"),
        (
            "deploy('deployment.yaml') raise('e_fast', { to = { a = 'demo' } })",
            "this table has keys: write `to = { \"NAME\" }`",
        ),
        ("deploy('deployment.yaml') raise('e_fast', { too = 'demo' })", "did you mean `to`?"),
    ] {
        let demo = Demo::new();
        demo.write("script.lua", script);
        let platform = ["run", "script.lua", "--clock", "simulated", "--platform", "simulated"];
        let ran = demo.run(&platform);
        let said = ran.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
        assert!(ran.code == 1 && said.contains(says), "{script}: {said}");
    }
    let demo = Demo::new();
    let raised =
        "raise('e_fast', { to = {} }) wait(1) assert(property('source.k') == 1) raise('e_fast', { to = 'demo' })
        wait_answer('fast.ok', 1)";
    demo.write("script.lua", &format!("deploy('deployment.yaml') wait_answer('slow.ok', 1) {raised} fail('source') wait(6) assert_state('source', 'faulted')"));
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert!(!ran.err.contains("davit::script"), "{}{}", ran.out, ran.err);
}
