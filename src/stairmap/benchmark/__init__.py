"""Any stair detector, scored on generated frames, drives and maps with known truth (docs/benchmark.md)."""
