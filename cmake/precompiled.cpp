// Nothing: a target that owns the shared precompiled header must have a source.
