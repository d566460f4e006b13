// Nothing: whether a browser runs a module in a worker is told by its asking for the kind (checks.ts).
