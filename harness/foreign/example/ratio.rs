// Ratio tracking in Rust behind nullmark_tracker.h: rustc --crate-type cdylib -O ratio.rs.  With --cfg slip it is wrong by 1 %.

use std::ffi::c_void;
use std::os::raw::c_char;

#[repr(C)]
pub struct Ray {
    size: u32,
    channels: i32,
    segments: i32,
    crossing: i32,
    id: u64,
    origin: [f64; 3],
    direction: [f64; 3],
    begin: f64,
    end: f64,
    segment_end: *const f64,
    rate: *const f64,
    minimum: *const f64,
    average: *const f64,
    maximum: *const f64,
    albedo: *const f64,
}

#[repr(C)]
pub struct Harness {
    size: u32,
    reserved: i32,
    this: *mut c_void,
    lookup: extern "C" fn(*mut c_void, i64, *const u32, *const f64, *mut f64) -> i32,
    lookup_at: extern "C" fn(*mut c_void, i64, *const u32, *const f64, *mut f64) -> i32,
    uniform: extern "C" fn(*mut c_void, i64, *const u32, *mut f64) -> i32,
    next: extern "C" fn(*mut c_void, i64, *const u32, *mut f64, *mut f64) -> i32,
}

#[repr(C)]
pub struct Results {
    size: u32,
    reserved: i32,
    value: *mut f64,
    distance: *mut f64,
    event: *mut u8,
    weight: *mut f64,
    lookups: *mut u64,
}

#[repr(C)]
pub struct Description {
    size: u32,
    guarantee: i32,
    range: i32,
    needs_bound: i32,
    own_medium: i32,
    streams: i32,
    order: f64,
}

#[repr(C)]
pub struct Tracker {
    size: u32,
    abi: i32,
    name: *const c_char,
    summary: *const c_char,
    source: *const c_char,
    version: *const c_char,
    quantities: u32,
    reserved: i32,
    create: extern "C" fn(*const c_char, *mut *mut c_void, *mut c_char, i64) -> i32,
    destroy: extern "C" fn(*mut c_void),
    describe: extern "C" fn(*mut c_void, i32, i32, *mut Description) -> i32,
    theory: Option<extern "C" fn(*mut c_void, *const Ray, i32, i32, *mut f64) -> i32>,
    sample: extern "C" fn(*mut c_void, *const Ray, *const Harness, u64, u64, i64, i32, *mut Results, *mut c_char, i64) -> i32,
}

unsafe impl Sync for Tracker {}

const SLIP: f64 = if cfg!(slip) { 1.01 } else { 1.0 };

extern "C" fn create(_: *const c_char, state: *mut *mut c_void, _: *mut c_char, _: i64) -> i32 {
    unsafe { *state = std::ptr::null_mut() };
    0
}

extern "C" fn destroy(_: *mut c_void) {}

extern "C" fn describe(_: *mut c_void, _: i32, _: i32, out: *mut Description) -> i32 {
    let out = unsafe { &mut *out };
    out.guarantee = 1;
    out.range = 1;
    0
}

extern "C" fn sample(
    _: *mut c_void, ray: *const Ray, harness: *const Harness, _: u64, _: u64, count: i64, _: i32, results: *mut Results,
    _: *mut c_char, _: i64,
) -> i32 {
    let (ray, harness) = unsafe { (&*ray, &*harness) };
    let (n, channels) = (count as usize, ray.channels as usize);
    let value = unsafe { std::slice::from_raw_parts_mut((*results).value, n * channels) };
    value.fill(1.0);
    let mut alive: Vec<u32> = (0..count as u32).collect();
    let (mut t, mut rate, mut extinction) = (vec![0.0; n], vec![0.0; n], vec![0.0; n * channels]);
    while !alive.is_empty() {
        let code = (harness.next)(harness.this, alive.len() as i64, alive.as_ptr(), t.as_mut_ptr(), rate.as_mut_ptr());
        if code != 0 {
            return code;
        }
        let inside: Vec<usize> = (0..alive.len()).filter(|&i| t[i].is_finite()).collect();
        for (to, &from) in inside.iter().enumerate() {
            alive[to] = alive[from];
            t[to] = t[from];
            rate[to] = rate[from];
        }
        alive.truncate(inside.len());
        let code = (harness.lookup)(harness.this, alive.len() as i64, alive.as_ptr(), t.as_ptr(), extinction.as_mut_ptr());
        if code != 0 {
            return code;
        }
        for (i, &k) in alive.iter().enumerate() {
            for c in 0..channels {
                value[k as usize * channels + c] *= (rate[i] - SLIP * extinction[i * channels + c]) / rate[i];
            }
        }
    }
    0
}

static TRACKER: Tracker = Tracker {
    size: std::mem::size_of::<Tracker>() as u32,
    abi: 1,
    name: b"ratio_in_rust\0".as_ptr() as *const c_char,
    summary: b"ratio tracking\0".as_ptr() as *const c_char,
    source: b"Novak, Selle, Jarosz 2014, Alg. 1\0".as_ptr() as *const c_char,
    version: b"1\0".as_ptr() as *const c_char,
    quantities: 1,
    reserved: 0,
    create,
    destroy,
    describe,
    theory: None,
    sample,
};

#[no_mangle]
pub extern "C" fn nullmark_get_tracker(_: i32, index: i32) -> *const Tracker {
    if index == 0 {
        &TRACKER
    } else {
        std::ptr::null()
    }
}
