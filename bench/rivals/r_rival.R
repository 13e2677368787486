# r_rival.R METHOD TRAIN TEST COLUMNS THREADS: one line of JSON, see run.py. Exit 77: not installed. Single-threaded.
arguments <- commandArgs(trailingOnly = TRUE)
method <- arguments[1]
columns <- as.integer(arguments[4])
package <- c(earth = "earth", lmtree = "partykit")[[method]]
if (!suppressMessages(requireNamespace(package, quietly = TRUE))) quit(status = 77)
suppressMessages(library(package, character.only = TRUE))

load <- function(path) {
  values <- readBin(path, "double", file.size(path) / 8)
  data <- as.data.frame(matrix(values, ncol = columns))
  names(data) <- c(paste0("x", seq_len(columns - 1)), "y")
  data
}
memory <- function() as.numeric(gsub("[^0-9]", "", grep("VmHWM", readLines("/proc/self/status"), value = TRUE))) * 1024
seconds <- function(work) {
  time <- proc.time()
  work()
  spent <- proc.time() - time
  c(wall = spent[["elapsed"]], cpu = sum(spent[c("user.self", "sys.self")]))
}

train <- load(arguments[2])
test <- load(arguments[3])
x <- paste(names(train)[-columns], collapse = " + ")
invisible(gc())
cat("5", file = "/proc/self/clear_refs")
before <- memory()
fit <- seconds(function() {
  model <<- if (method == "earth") earth(y ~ ., data = train, degree = 2)
            else lmtree(as.formula(paste("y ~", x, "|", x)), data = train)
})
peak <- memory() - before
runs <- 0
predict_time <- seconds(function() {
  start <- proc.time()[["elapsed"]]
  while (runs == 0 || proc.time()[["elapsed"]] - start < 0.5) {
    predicted <<- as.vector(predict(model, newdata = test))
    runs <<- runs + 1
  }
})
per_million <- 1e6 / (runs * nrow(test))
leaves <- if (method == "earth") nrow(coef(model)) else width(model)
if (is.null(leaves)) leaves <- length(coef(model))
cat(sprintf(paste0('{"fit_wall": %g, "fit_cpu": %g, "predict_wall": %g, "predict_cpu": %g, "memory": %g, ',
                   '"rmse": %.10g, "leaves": %d, "version": "%s"}\n'),
            fit[["wall"]], fit[["cpu"]], predict_time[["wall"]] * per_million, predict_time[["cpu"]] * per_million, peak,
            sqrt(mean((predicted - test$y)^2)), as.integer(leaves), as.character(packageVersion(package))))
