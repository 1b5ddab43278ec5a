use moreau2d::scene::{self, threshing::*};
use moreau2d::wear::Profile;
fn main(){
 let k: f64 = std::env::args().nth(1).unwrap().parse().unwrap();
 let n: usize = std::env::args().nth(2).unwrap().parse().unwrap();
 let s = scene::load("thresher", &std::env::args().skip(3).collect::<Vec<_>>()).unwrap(); let p=s.thresher.clone().unwrap(); let t=s.tooth.unwrap();
 let prof = Profile::quadratic(t.alpha,t.beta,t.gamma,t.width,26).unwrap().raised_to(0.0).unwrap();
 let mut w = ThreshingWorld::new(&s,&p,&t,&prof,k).unwrap();
 let t0=std::time::Instant::now();
 let (mut mot,mut nc,mut unsol,mut sw,mut fa)=(0.0,0,0,0,0);let mut pn=0.0f64; let mut imb=0.0f64; let mut gmin=0.0f64;
 for i in 0..n { let r=w.step().unwrap(); mot+=r.energy.motors; nc+=r.contacts.len(); unsol+=r.unsolved; sw+=r.sweeps; fa+=r.factorisations; imb=imb.max(r.energy.imbalance().abs());
  for c in &r.contacts { pn=pn.max(c.impulse_n/2e-5); gmin=gmin.min(c.gap);}
  if (i+1)%500==0 { println!("t {:.4} w {:.2} segs {} torque {:.1} contacts {:.1} unsolved {unsol} sweeps {:.1} fact {:.2} maxN {:.0} gmin {:.1}mm imb {imb:.1e} KEcrop {:.2} us/step {:.0} res {:.1e}", r.time, w.speed(), w.segments(), mot/(500.0*2e-5)/70.0*1.3, nc as f64/500.0, sw as f64/500.0, fa as f64/500.0, pn, gmin*1e3, w.crop_energy(), t0.elapsed().as_secs_f64()*1e6/(i+1) as f64, r.residual); mot=0.0;nc=0;sw=0;fa=0;pn=0.0;gmin=0.0;}
 }
 // svg
 let mut o=String::from("<svg xmlns='http://www.w3.org/2000/svg' viewBox='-350 -350 700 700' width='1000' height='1000'><rect x='-350' y='-350' width='700' height='700' fill='white'/>");
 let b=w.bodies();
 for (i,(q,_)) in b.iter().enumerate(){ if i==0 { for k in 0..8 { let f=k as f64*std::f64::consts::TAU/8.0; let (so,co)=f.sin_cos(); let pts:Vec<String>=prof.outline(0.008).unwrap().iter().map(|e|{let l=0.2312; let x=co*(l+e.y)-so*e.x; let y=so*(l+e.y)+co*e.x; let v=q.apply(moreau2d::contact::Vec2::new(x,y)); format!("{:.2},{:.2}",v.x*1e3,-v.y*1e3)}).collect(); o+=&format!("<polygon points='{}' fill='#999' stroke='black' stroke-width='.5'/>",pts.join(" ")); } continue;}
  let pts:Vec<String>=[(0.01,0.008),(-0.01,0.008),(-0.01,-0.008),(0.01,-0.008)].iter().map(|e|{let v=q.apply(moreau2d::contact::Vec2::new(e.0,e.1)); format!("{:.2},{:.2}",v.x*1e3,-v.y*1e3)}).collect(); o+=&format!("<polygon points='{}' fill='#fc6' stroke='black' stroke-width='.5'/>",pts.join(" ")); }
 let arc:Vec<String>=(0..=110).map(|i|{let a=(215.0+i as f64).to_radians(); let r=0.266-0.008*i as f64/110.0; format!("{:.2},{:.2}",r*a.cos()*1e3,-r*a.sin()*1e3)}).collect(); o+=&format!("<polyline points='{}' fill='none' stroke='blue'/>",arc.join(" "));
 o+="</svg>"; std::fs::write("/tmp/th.svg",o).unwrap();
}
