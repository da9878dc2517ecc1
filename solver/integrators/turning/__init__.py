"""Bodies that turn, held together by joints: the equations are in docs/mechanisms.md."""
