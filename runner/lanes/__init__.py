"""Many runs of one model at once: SIMD lanes over runs, packs of lanes over cores."""
