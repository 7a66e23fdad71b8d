use crate::drive::run;

#[test]
#[ignore]
fn probe() {
    let scene = std::env::var("P_SCENE").unwrap();
    let spec = std::env::var("P_SPEC").unwrap();
    let rates = std::env::var("P_RATES").unwrap_or("240".into());
    let quiet = std::env::var("P_QUIET").is_ok();
    for rate in rates.split(',') {
        let rate: f64 = rate.parse().unwrap();
        let run = run(&scene, &spec, rate, 0.0);
        println!("== {rate} Hz, duration {:.2}", run.hand.duration_s());
        for (tick, event) in &run.events {
            let name = event.kind.name();
            if quiet && name.starts_with("contact") { continue; }
            let slot = event.object.map(|o| o.slot as usize);
            let p = slot.map(|s| run.position(*tick, s));
            println!("{:.3} {:?} {:?} {:?}", *tick as f64 / rate, slot, p.map(|p| [p.x, p.y, p.z].map(|x| (x * 1e4).round() / 10.0)), event.kind);
        }
        for (i, o) in run.scene.objects.iter().enumerate() {
            let l = run.last(i);
            println!("{} {:?} rest {}", o.name, l.pose, l.resting);
        }
    }
}
