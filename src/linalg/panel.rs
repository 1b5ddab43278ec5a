//! Dense operations on panels: matrices by columns, with a given `stride` between columns.

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, dispatch, f64x4};

/// Every stride is a multiple of this number: with padded rows no column needs a shorter last tile.
pub const ALIGN: usize = 4;

/// A read-only panel: its numbers and its stride.
pub type View<'a> = (&'a [f64], usize);

/// `C −= A Bᵀ` in the blocks on and below the diagonal of C; numbers above the diagonal become
/// invalid.
///
/// `c` begins with the `columns` to change, each with all rows; their diagonal begins in row
/// `first`. The first row of A is that of C. B is the part of A's panel that begins in row `first`.
/// Both have `depth` columns. N divides `columns`. Every number sums its products in the same order
/// on every machine.
pub fn subtract_product<const N: usize>(
    level: Level,
    (c, c_stride): (&mut [f64], usize),
    first: usize,
    [columns, depth]: [usize; 2],
    a: View,
    b: View,
) {
    dispatch!(level, simd => subtract::<_, N>(simd, (c, c_stride), first, [columns, depth], a, b));
}

#[inline(always)]
fn subtract<S: Simd, const N: usize>(
    simd: S,
    (c, c_stride): (&mut [f64], usize),
    first: usize,
    [columns, depth]: [usize; 2],
    a: View,
    (b, stride): View,
) {
    let lanes = S::f64s::LEN;
    for j in (0..columns).step_by(N) {
        let c = &mut c[j * c_stride..];
        let b = (&b[first + j..], stride);
        let mut i = (first + j) / ALIGN * ALIGN;
        while i + 4 * lanes <= c_stride {
            tile::<S, S::f64s, 4, N>(simd, (c, c_stride), depth, a, b, i);
            i += 4 * lanes;
        }
        if i + 2 * lanes <= c_stride {
            tile::<S, S::f64s, 2, N>(simd, (c, c_stride), depth, a, b, i);
            i += 2 * lanes;
        }
        if lanes >= ALIGN && i + lanes <= c_stride {
            tile::<S, S::f64s, 1, N>(simd, (c, c_stride), depth, a, b, i);
            i += lanes;
        }
        if lanes > ALIGN && i < c_stride {
            tile::<S, f64x4<S>, 1, N>(simd, (c, c_stride), depth, a, b, i);
        }
    }
}

/// A tile of `R` vectors of rows from `i` on, and of `N` columns.
#[inline(always)]
fn tile<S: Simd, V: SimdFloat<S, Element = f64>, const R: usize, const N: usize>(
    simd: S,
    (c, c_stride): (&mut [f64], usize),
    depth: usize,
    (a, stride): View,
    (b, _): View,
    i: usize,
) {
    let lanes = V::LEN;
    let mut sum = [[V::splat(simd, 0.0); R]; N];
    for p in 0..depth {
        let a = &a[p * stride + i..][..R * lanes];
        let b = &b[p * stride..][..N];
        for (sum, b) in sum.iter_mut().zip(b) {
            let b = V::splat(simd, *b);
            for (r, sum) in sum.iter_mut().enumerate() {
                *sum += V::from_slice(simd, &a[r * lanes..][..lanes]) * b;
            }
        }
    }
    for (k, sum) in sum.iter().enumerate() {
        let c = &mut c[k * c_stride + i..][..R * lanes];
        for (r, sum) in sum.iter().enumerate() {
            let c = &mut c[r * lanes..][..lanes];
            (V::from_slice(simd, c) - *sum).store_slice(c);
        }
    }
}

/// `t −= A y` with the `N` columns of A; `t` has a multiple of [`ALIGN`] rows.
#[inline(always)]
pub fn subtract_columns<S: Simd, const N: usize>(
    simd: S,
    t: &mut [f64],
    (a, stride): View,
    y: [f64; N],
) {
    let rows = t.len();
    let y = y.map(|y| f64x4::splat(simd, y));
    let mut columns = [&a[..0]; N];
    for (k, column) in columns.iter_mut().enumerate() {
        *column = &a[k * stride..][..rows];
    }
    for (i, t) in t.chunks_exact_mut(ALIGN).enumerate() {
        let mut sum = f64x4::from_slice(simd, t);
        for (column, y) in columns.iter().zip(&y) {
            sum -= f64x4::from_slice(simd, &column[i * ALIGN..][..ALIGN]) * *y;
        }
        sum.store_slice(t);
    }
}

/// `y −= Aᵀ t` with the `N` columns of A; `t` has a multiple of [`ALIGN`] rows.
#[inline(always)]
pub fn subtract_products<S: Simd, const N: usize>(
    simd: S,
    y: &mut [f64; N],
    (a, stride): View,
    t: &[f64],
) {
    let rows = t.len();
    let mut columns = [&a[..0]; N];
    for (k, column) in columns.iter_mut().enumerate() {
        *column = &a[k * stride..][..rows];
    }
    let mut sums = [f64x4::splat(simd, 0.0); N];
    for (i, t) in t.chunks_exact(ALIGN).enumerate() {
        let t = f64x4::from_slice(simd, t);
        for (column, sum) in columns.iter().zip(&mut sums) {
            *sum += f64x4::from_slice(simd, &column[i * ALIGN..][..ALIGN]) * t;
        }
    }
    for (y, sum) in y.iter_mut().zip(&sums) {
        let [p, q, r, s] = sum.as_slice().try_into().unwrap_or([0.0; ALIGN]);
        *y -= (p + r) + (q + s);
    }
}
