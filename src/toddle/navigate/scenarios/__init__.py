"""Where the walker has to find its way: seeded layouts, a planner that knows which can be solved, a driver."""
