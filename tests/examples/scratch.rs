use film_feed::machine::*;
use film_feed::operator::FeedPlan;
use film_feed::report::FeedMode;
use film_feed::rig::*;
use film_feed::run::*;
fn main() {
    for speed in [1000, 1200, 1500, 1800, 2000, 2500, 3000, 4000, 4080, 4200] {
        let plan = FeedPlan {
            mark_speed_hundredth_percent: speed,
            series: vec![(FeedMode::Mark, 2)],
            ..FeedPlan::default()
        };
        let mut c = RigConfig::default();
        c.film.marks = MarkConfig {
            repeat_mm: 1200.0,
            tolerance_mm: 0.0,
            ..MarkConfig::default()
        };
        let (r, s) = simulated(&c, plan, Observation::Samples, || {}).unwrap();
        for f in &r.feeds {
            let mut hi = f64::MIN;
            let mut ret = 0.0f64;
            for x in s.iter().filter(|x| x.feed == f.n) {
                hi = hi.max(x.film_mm);
                ret = ret.max(hi - x.film_mm);
            }
            println!(
                "{speed} feed {} retreat {ret:.4} rev {} inpos {:?} setp {:?} job {:?} err {:?} follow {:?}",
                f.n, f.reversed, f.in_position_s, f.set_point_s, f.job_s, f.error_mm, f.max_following_error_mm
            );
        }
    }
    for speed in [1000, 2000, 5000, 10000] {
        for accel in [1000, 3000, 5000, 10000] {
            let plan = FeedPlan {
                speed_hundredth_percent: speed,
                accel_hundredth_percent: accel,
                mark_speed_hundredth_percent: 1000,
                series: vec![(FeedMode::Length, 2)],
                ..FeedPlan::default()
            };
            let (r, s) = simulated(&RigConfig::default(), plan, Observation::Samples, || {}).unwrap();
            for f in &r.feeds {
                let mut hi = f64::MIN;
                let mut ret = 0.0f64;
                for x in s.iter().filter(|x| x.feed == f.n) {
                    hi = hi.max(x.film_mm);
                    ret = ret.max(hi - x.film_mm);
                }
                println!(
                    "len {speed}/{accel} feed {} retreat {ret:.4} rev {} inpos {:?} setp {:?} job {:?} err {:?} follow {:?}",
                    f.n, f.reversed, f.in_position_s, f.set_point_s, f.job_s, f.error_mm, f.max_following_error_mm
                );
            }
        }
    }
}
