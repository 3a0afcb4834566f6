"""Find a better design: spaces of parameters, methods that search them, studies that keep all."""
