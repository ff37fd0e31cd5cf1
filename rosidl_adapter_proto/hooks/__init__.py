"""Build hooks: adapters come out of a build, with no extra step. Every hook calls `generate`."""
