use cathforce_reference::*;
use nalgebra::Vector3;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let h: f64 = args[1].parse().unwrap();
    let dt: f64 = args[2].parse().unwrap();
    let mu: f64 = args[3].parse().unwrap();
    let kind = &args[4];
    let k: f64 = args.get(5).map_or(8e5, |x| x.parse().unwrap());
    let tube = |e: f64, l: f64| Section::tube(l, 1.65e-3, 1.02e-3, e, 0.4, 1100.0);
    let curves = if kind == "feed" || kind=="rev" { vec![] } else { vec![Curve { length_m: 4e-3, up_per_m: 10.0, side_per_m: 0.0 }, Curve { length_m: 20e-3, up_per_m: 60.0, side_per_m: 0.0 }] };
    let lumen = Lumen::tube(TubePath::from(Vector3::zeros(), Vector3::x(), 5e-3).straight(0.04, 5e-3).arc(0.04, 60f64.to_radians(), Vector3::y(), 4e-3).straight(0.05, 3e-3).straight(0.02,3e-3).tube());
    let problem = Problem {
        rod: Rod { radius_m: 0.825e-3, sections: vec![tube(50e6, 0.05), tube(26e6, 0.6)], curves },
        entry: Entry { position_m: Vector3::zeros(), direction: Vector3::x(), up: Vector3::y() },
        lumen,
        wall: WallLaw { line_stiffness_n_per_m2: k, end_stiffness_n_per_m: k / 400.0, tangential_ratio: 3.0, friction_coefficient: mu },
        gravity_m_per_s2: Vector3::z() * -9.81,
        drag_n_s_per_m2: 0.2,
        tip_load: TipLoad::default(),
        numerics: Numerics { spacing_m: h, step_s: dt, integrator: if args.get(6).is_some() {Integrator::Euler} else {Integrator::Bdf2}, tolerance_n: 1e-8 },
    };
    let s = Schedule::starting_at(0.03, 0.0);
    let s = match kind.as_str() { "feed"|"prefeed" => s.then(7.0, 0.2, 0.013, 0.0).then(0.5, 0.2, 0.0, 0.0),
       "rev" => s.then(5.0, 0.2, 0.013, 0.0).then(2.0, 0.4, -0.013, 0.0).then(2.0, 0.4, 0.013, 0.0),
       _ => s.then(4.0, 0.2, 0.013, 0.0).then(6.0, 0.2, 0.0, 2.0) };
    let t0 = std::time::Instant::now();
    match run(&problem, &s) {
        Err(e) => println!("{e}"),
        Ok((samples, effort)) => {
            let n = samples.len();
            for k in (0..n).step_by(n / 20) { let s = &samples[k]; println!("{:.3} {:.4} {:.3} drive {:.5} normal {:.5} tip {:.4} {:.4} {:.4} {} {}", s.t_s, s.drive.insertion_m, s.drive.rotation_rad, 1e3*s.drive_force_n, 1e3*s.normal_force_n, 1e3*s.tip_m.x,1e3*s.tip_m.y,1e3*s.tip_m.z,s.sliding,s.sticking); }
            println!("{effort:?} {:?}", t0.elapsed());
            let mut out = String::new();
            for s in &samples { out += &format!("{} {} {} {} {} {}\n", s.t_s, s.drive_force_n, s.force_on_vessel_n.x, s.force_on_vessel_n.y, s.force_on_vessel_n.z, s.normal_force_n); }
            std::fs::write(std::env::var("OUT").unwrap_or("/tmp/ref_out.txt".into()), out).unwrap();
        }
    }
}
