"""The study which solution a method finds: methods, parameters, starts."""
