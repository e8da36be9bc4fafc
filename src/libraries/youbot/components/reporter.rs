//! `youbot.Reporter`: writes what happened to a file.

use super::samples::{ExtRef, JointState, Odometry, ToolPose};
use crate::model::Tunable;
use crate::runtime::{Builder, Component, Context, Failure, In, OperationAnswer, Prop};
use nalgebra::Vector3;
use std::fs::File;
use std::io::{BufWriter, Write};

/// The component.
pub struct Reporter {
    tool_pose: In<ToolPose>,
    ext_ref: In<ExtRef>,
    jointstate: In<JointState>,
    odometry: In<Odometry>,
    f_des: In<Vector3<f64>>,
    f_raw_norm: In<f64>,
    active: In<bool>,
    path: Prop<String>,
    file: Option<BufWriter<File>>,
}

impl Component for Reporter {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Writes a CSV file, one row an update: time, tool, other tool, force, joints, base. Without a path, none.",
        )
        .on_configure(|c, _| {
            let path = c.path.get();
            c.file = None;
            if !path.is_empty() {
                let fail = |e: std::io::Error| Failure(format!("{path}: {e}"));
                let mut file = BufWriter::new(File::create(&path).map_err(fail)?);
                let joints: String = (1..=5).map(|i| format!(",q{i},tau{i}")).collect();
                writeln!(file, "t,active,x,y,z,ref_x,ref_y,ref_z,f_raw,f_x,f_y,f_z{joints},base_x,base_y,base_th")
                    .map_err(fail)?;
                c.file = Some(file);
            }
            Ok(())
        })
        .on_stop(|c, _| c.flush())
        .on_cleanup(|c, _| {
            c.flush()?;
            c.file = None;
            Ok(())
        });
        b.doc("Brings what was recorded onto the disk.")
            .no_effect()
            .operation("snapshot", |c, _, (): ()| OperationAnswer::from(c.flush()));
        Self {
            tool_pose: b.doc("Where the tool is.").input("tool_pose"),
            ext_ref: b.doc("Where the other tool is.").input("ext_ref"),
            jointstate: b.doc("What the joints measure.").input("jointstate"),
            odometry: b.doc("Where the base is.").input("odometry"),
            f_des: b.doc("Force put out.").unit("N").input("f_des"),
            f_raw_norm: b.doc("Norm of the wanted force.").unit("N").input("f_raw_norm"),
            active: b.doc("Whether the coupling is engaged.").input("active"),
            path: b.doc("The file; empty: none.").tunable(Tunable::Unconfigured).property("path", String::new()),
            file: None,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some(file) = &mut self.file else { return };
        let tool = self.tool_pose.get().map_or([f64::NAN; 3], |p| p.p);
        let other = self.ext_ref.get().map_or([f64::NAN; 3], |p| p.p);
        let force = self.f_des.get().unwrap_or_default();
        let joints = self.jointstate.get().unwrap_or_default();
        let base = self.odometry.get().unwrap_or_default();
        let raw = self.f_raw_norm.get().unwrap_or(f64::NAN);
        let active = u8::from(self.active.get().unwrap_or(false));
        let mut row = || -> std::io::Result<()> {
            write!(file, "{:.3},{active}", cx.now().as_secs_f64())?;
            for v in tool.iter().chain(&other).chain(&[raw]).chain(force.iter()) {
                write!(file, ",{v:.5}")?;
            }
            for i in 0..5 {
                write!(file, ",{:.5},{:.4}", joints.pos[i], joints.eff[i])?;
            }
            writeln!(file, ",{:.4},{:.4},{:.4}", base.x, base.y, base.th)
        };
        if let Err(e) = row() {
            cx.fault(format!("{}: {e}", self.path.get_ref()));
        }
    }
}

impl Reporter {
    fn flush(&mut self) -> Result<(), Failure> {
        match &mut self.file {
            Some(file) => file.flush().map_err(|e| Failure::from_error(&e)),
            None => Ok(()),
        }
    }
}
