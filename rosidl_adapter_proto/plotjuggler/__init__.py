"""Parser plugins of PlotJuggler, in WebAssembly: building them, and running any of them from Python."""
