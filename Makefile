# Each target does its own set-up; `make` alone lists them.
.DEFAULT_GOAL := help
.PHONY: help setup render inspect bench test mutants software-vulkan validate-vulkan format lint clean

BIN := .venv/bin

help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 20

setup: ## install what a render needs; leaves .venv/bin/lab (EXTRA=kornia|gui|vulkan|test|all: that extra too)
	@bash .house/setup.sh $(EXTRA)

render: setup ## render the default scene to out/atrium.png, .exr and .json
	$(BIN)/lab render scenes/atrium/scene.toml -o out/atrium

inspect: ## look into the default scene in a browser (SCENE=file: into that one)
	@bash .house/setup.sh gui
	$(BIN)/lab inspect $(or $(SCENE),scenes/atrium/scene.toml)

bench: setup ## measure the default scene's stages against this machine's limits; out/atrium-bench.png and .json
	$(BIN)/lab bench scenes/atrium/scene.toml

test: ## install every extra and run all tests and checks
	@bash .house/setup.sh all
	$(BIN)/python -m pytest

mutants: ## break one formula at a time in a copy, and see its tests fail (minutes; ONLY="lobe k": that one)
	@bash .house/setup.sh all
	$(BIN)/python tests/mutants/run.py $(if $(ONLY),--only "$(ONLY)")

format: ## format Python and C++
	@bash .house/setup.sh all
	$(BIN)/ruff check --fix --select I .
	$(BIN)/ruff format .
	git ls-files --cached --others --exclude-standard '*.cpp' '*.h' | xargs -r $(BIN)/clang-format -i

lint: ## only the checks: ruff, mypy, clang-format, repository rules
	@bash .house/setup.sh all
	$(BIN)/python -m pytest tests/repo

software-vulkan: ## install a Vulkan driver that needs no graphics card (Debian 12)
	@bash .house/software_vulkan.sh

validate-vulkan: ## render frames under Vulkan's validation layers, in a Debian 13 where these are too old (as root)
	@bash .house/validate_vulkan.sh $(ARGUMENTS)

clean: ## remove what was built, rendered and installed
	rm -rf .venv build out .lab-evidence .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
