//! Kinematics and dynamics against Pinocchio (`tests/golden/generate.py` makes the values).

use davit::libraries::youbot::parameters::BASE_MOUNT;
use davit::libraries::youbot::rigid_body::{ArmModel, BaseMotion, J5};
use nalgebra::Vector3;
use serde_json::Value;

const TOLERANCE: f64 = 1e-9;

fn numbers(case: &Value, key: &str) -> Vec<f64> {
    fn flat(v: &Value, out: &mut Vec<f64>) {
        match v {
            Value::Array(items) => items.iter().for_each(|i| flat(i, out)),
            other => out.push(other.as_f64().expect("a number")),
        }
    }
    let mut out = Vec::new();
    flat(&case[key], &mut out);
    out
}

fn j5(case: &Value, key: &str) -> J5 {
    J5::from_column_slice(&numbers(case, key))
}

fn close(what: &str, ours: impl IntoIterator<Item = f64>, golden: &[f64]) {
    let ours: Vec<f64> = ours.into_iter().collect();
    assert_eq!(ours.len(), golden.len(), "{what}");
    for (a, b) in ours.iter().zip(golden) {
        assert!((a - b).abs() < TOLERANCE, "{what}: {ours:?} instead of {golden:?}");
    }
}

#[test]
fn kinematics_gravity_mass_matrix_and_inverse_dynamics_are_pinocchios() {
    let text = include_str!("../golden/youbot.json");
    let file: Value = serde_json::from_str(text).unwrap();
    let cases = file["cases"].as_array().unwrap();
    assert!(cases.len() >= 50);
    let model = ArmModel::youbot(0.219, 1.0);
    for case in cases {
        let at = model.posture(&j5(case, "q"));
        let (qd, qdd) = (j5(case, "qd"), j5(case, "qdd"));
        close("tool", at.tool.iter().copied(), &numbers(case, "tool"));
        close("rotation", at.rotations[4].matrix().transpose().iter().copied(), &numbers(case, "rotation"));
        close("jacobian", at.jacobian().transpose().iter().copied(), &numbers(case, "jacobian"));
        close("gravity", model.gravity(&at).iter().copied(), &numbers(case, "gravity"));
        close("mass matrix", model.mass_matrix(&at).iter().copied(), &numbers(case, "mass_matrix"));
        let torque = model.inverse_dynamics(&at, &qd, &qdd, &BaseMotion::default());
        close("torque", torque.iter().copied(), &numbers(case, "torque"));

        let (v, a) = (numbers(case, "base_velocity"), numbers(case, "base_acceleration"));
        let mount = Vector3::from(BASE_MOUNT);
        let angular = Vector3::new(0.0, 0.0, v[2]);
        let angular_acc = Vector3::new(0.0, 0.0, a[2]);
        // Coordinates of the planar joint are in its own, turning frame.
        let linear_acc = Vector3::new(a[0], a[1], 0.0)
            + angular.cross(&Vector3::new(v[0], v[1], 0.0))
            + angular_acc.cross(&mount)
            + angular.cross(&angular.cross(&mount));
        let torque = model.inverse_dynamics(&at, &qd, &qdd, &BaseMotion { angular, angular_acc, linear_acc });
        close("torque on a moving base", torque.iter().copied(), &numbers(case, "torque_on_moving_base"));
    }
}
