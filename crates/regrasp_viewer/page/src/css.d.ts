// The build writes it beside the script.
declare module "*.css";
